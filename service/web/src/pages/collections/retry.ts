// Trying again what failed earlier: which job a shape failed in, and that job once more.

import { ask, Problem, queryText } from "../../api/client";
import { hasEnded } from "../../api/jobs";
import type { Job, Page, Shape } from "../../api/types";

const PAGE = 200;
/** A file's shape and its job are made in one step. */
const TOGETHER_MILLISECONDS = 5000;

/** Queue a failed shape again, with all that failed in its job; null where no job is found that could. */
export async function tryAgain(shape: Shape): Promise<Job | null> {
  for await (const job of jobsOf(shape)) {
    if (!hasEnded(job)) continue;
    const again = await retry(job.id);
    if (again === null) continue;
    const now = await ask<Shape>(`v1/shapes/${shape.id}`);
    if (now.state !== "failed") return again;
  }
  return null;
}

/** Retry a job; null where nothing in it can be. */
async function retry(id: string): Promise<Job | null> {
  try {
    return await ask<Job>(`v1/jobs/${id}/retry`, { method: "POST" });
  } catch (error) {
    if (error instanceof Problem && error.status === 409) return null;
    throw error;
  }
}

/** Jobs that the shape may have failed in, the likeliest first. */
async function* jobsOf(shape: Shape): AsyncGenerator<Job> {
  if (shape.error?.type === "cancelled") return yield* cancelledWith(shape);
  for await (const job of ingestJobs(shape.collection)) {
    const isNamed = ({ item, detail }: { item: string; detail: string }) =>
      (item === shape.path || item === shape.name) && detail === shape.error?.detail;
    if (job.errors.some(isNamed)) yield job;
  }
}

/** Cancelled jobs name no shapes: the one made right after the shape, then the one before it, of an archive. */
async function* cancelledWith(shape: Shape): AsyncGenerator<Job> {
  const made = Date.parse(shape.created_at);
  let after: Job | null = null;
  let before: Job | null = null;
  for await (const job of ingestJobs(shape.collection, "cancelled")) {
    if (Date.parse(job.created_at) >= made) after = job;
    else {
      before = job;
      break;
    }
  }
  if (after !== null && Date.parse(after.created_at) < made + TOGETHER_MILLISECONDS) yield after;
  if (before !== null) yield before;
}

async function* ingestJobs(collection: string, state?: string): AsyncGenerator<Job> {
  let cursor: string | null = null;
  do {
    const query = queryText({ collection, kind: "ingest", state, limit: PAGE, cursor });
    const page: Page<Job> = await ask<Page<Job>>(`v1/jobs${query}`);
    yield* page.items;
    cursor = page.next_cursor;
  } while (cursor !== null);
}
