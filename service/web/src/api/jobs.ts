// Long work, watched: server-sent events, read with fetch so that a key can go along.

import { ask, Problem, send } from "./client";
import type { Job, State } from "./types";

const AGAIN_MILLISECONDS = 1500;
const ENDED: ReadonlySet<State> = new Set(["succeeded", "failed", "cancelled"]);

export function hasEnded(job: { state: State }): boolean {
  return ENDED.has(job.state);
}

/** Report a job now and at each change, until it has ended; continues after an outage. */
export async function watchJob(id: string, report: (job: Job) => void, signal: AbortSignal): Promise<Job> {
  for (;;) {
    try {
      const last = await follow(id, report, signal);
      if (last !== null && hasEnded(last)) return last;
    } catch (error) {
      if (signal.aborted || !(error instanceof Problem) || !error.isAway) throw error;
    }
    await pause(AGAIN_MILLISECONDS, signal);
    const job = await ask<Job>(`v1/jobs/${id}`, { signal }).catch((error) => {
      if (error instanceof Problem && error.isAway) return null;
      throw error;
    });
    if (job !== null) {
      report(job);
      if (hasEnded(job)) return job;
    }
  }
}

async function follow(id: string, report: (job: Job) => void, signal: AbortSignal): Promise<Job | null> {
  const response = await send(`v1/jobs/${id}/events`, { signal });
  const reader = response.body?.pipeThrough(new TextDecoderStream()).getReader();
  if (!reader) return null;
  let last: Job | null = null;
  let text = "";
  for (;;) {
    const { done, value } = await reader.read().catch(() => ({ done: true, value: undefined }));
    if (done || value === undefined) return last;
    text += value.replaceAll("\r\n", "\n");
    const events = text.split("\n\n");
    text = events.pop() ?? "";
    for (const event of events) {
      const data = event.split("\n").filter((line) => line.startsWith("data:"));
      if (!data.length) continue;
      last = JSON.parse(data.map((line) => line.slice(5).trimStart()).join("\n")) as Job;
      report(last);
    }
  }
}

export function pause(milliseconds: number, signal?: AbortSignal): Promise<void> {
  return new Promise((resolve, reject) => {
    const timer = setTimeout(resolve, milliseconds);
    signal?.addEventListener("abort", () => {
      clearTimeout(timer);
      reject(new DOMException("stopped", "AbortError"));
    });
  });
}
