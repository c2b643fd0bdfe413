// Uploads that go on while other pages are looked at: what is sent, in which requests, and what came of it.

import { computed, signal } from "@preact/signals";
import { ask, Problem, upload as post } from "../../api/client";
import { pause } from "../../api/jobs";
import type { Job, Shape } from "../../api/types";
import { sentence } from "../../ui/basics";
import { asProblem } from "../../ui/loading";
import { notify, notifyProblem } from "../../ui/toasts";
import { filesOf, nextBatch, outcomes } from "./batches";
import type { Picked, Skipped } from "./files";
import { each } from "./pool";
import { Work, type At, type Part, type Upload } from "./work";

const AT_ONCE = 2;
const TRIES = 3;
const AWAY_MILLISECONDS = 2000;
const OF_THE_FILE = [400, 413, 415, 422];

/** What is sent to one collection. */
export class Uploads {
  readonly all = signal<readonly Upload[]>([]);
  /** Skipped before it was sent, or by the service without its job naming it. */
  private readonly unsent = signal<readonly Skipped[]>([]);
  private readonly works = signal<readonly Work[]>([]);
  readonly skipped = computed(() => skippedIn(this.unsent.value, this.works.value));
  readonly groups = computed(() => grouped(this.all.value));
  readonly isBusy = computed(() =>
    (["waiting", "sending", "computing"] as const).some((is) => this.groups.value.has(is)),
  );
  readonly isSending = computed(() => this.groups.value.has("waiting") || this.groups.value.has("sending"));
  private queue: Upload[] = [];
  private senders = 0;
  private last = 0;
  private abort = new AbortController();

  constructor(public collection: string) {}

  add(picked: Picked): void {
    const added = picked.files.map((sent): Upload => {
      return { ...sent, id: ++this.last, at: signal<At>({ is: "waiting" }), tries: 0 };
    });
    this.all.value = [...this.all.value, ...added];
    this.unsent.value = [...this.unsent.value, ...picked.skipped];
    this.enqueue(added);
  }

  /** Send and compute no more; what is ready stays. */
  stop(): void {
    this.abort.abort();
    this.abort = new AbortController();
    for (const upload of this.queue) upload.at.value = { is: "stopped", work: null };
    this.queue = [];
    void each(this.works.value, 4, (work) => work.cancel()).catch(notifyProblem);
  }

  /** Send again what was not sent, compute again what could not be computed. */
  async retry(uploads: readonly Upload[]): Promise<void> {
    const unsent = uploads.filter((upload) => workOf(upload) === null);
    const works = new Set(uploads.map(workOf));
    for (const upload of unsent) upload.tries = 0;
    this.enqueue(unsent);
    for (const work of works) {
      if (work === null) continue;
      try {
        const again = await work.retry();
        if (again !== null) this.works.value = [...this.works.value, again];
        else notify("No job was found in which it could be tried again.");
      } catch (error) {
        notifyProblem(error);
      }
    }
  }

  clear(): void {
    this.all.value = [];
    this.unsent.value = [];
    this.works.value = [];
  }

  private enqueue(uploads: readonly Upload[]): void {
    for (const upload of uploads) upload.at.value = { is: "waiting" };
    this.queue.push(...uploads);
    while (this.senders < AT_ONCE && this.queue.length > 0) void this.work();
  }

  private async work(): Promise<void> {
    this.senders++;
    while (this.queue.length > 0) {
      const batch = nextBatch(this.queue);
      await this.send(batch, this.abort.signal);
    }
    this.senders--;
  }

  private async send(batch: readonly Upload[], stopped: AbortSignal): Promise<void> {
    const share = signal(0);
    const form = new FormData();
    for (const upload of batch) upload.at.value = { is: "sending", share };
    for (const { file, name } of filesOf(batch)) form.append("files", file, name);
    try {
      const path = `v1/collections/${this.collection}/shapes`;
      const { answer } = await post<{ job: Job; shapes: Shape[] }>(
        path,
        form,
        (value) => (share.value = value),
        stopped,
      );
      const work = new Work(answer.job, await this.sent(batch, answer));
      this.works.value = [...this.works.value, work];
      if (stopped.aborted) await work.cancel();
    } catch (error) {
      if (stopped.aborted) for (const upload of batch) upload.at.value = { is: "stopped", work: null };
      else await this.refused(batch, asProblem(error), stopped);
    }
  }

  /** The files of which shapes come; what is skipped is no file among the others any more. */
  private async sent(batch: readonly Upload[], answer: { job: Job; shapes: Shape[] }): Promise<Part[]> {
    const parts: Part[] = [];
    const skipped = new Set<Upload>();
    for (const [i, outcome] of (await outcomes(batch, answer.job, answer.shapes)).entries()) {
      const upload = batch[i]!;
      if ("shape" in outcome) parts.push({ upload, shape: outcome.shape });
      else {
        skipped.add(upload);
        if (!answer.job.skipped.includes(outcome.skipped)) this.unsent.value = [...this.unsent.value, outcome.skipped];
      }
    }
    this.all.value = this.all.value.filter((upload) => !skipped.has(upload));
    return parts;
  }

  private async refused(batch: readonly Upload[], problem: Problem, stopped: AbortSignal): Promise<void> {
    if (problem.isAway) return this.sendLater(batch, problem, stopped);
    if (!OF_THE_FILE.includes(problem.status)) {
      fail([...batch, ...this.queue.splice(0)], problem); // of the others nothing else would become
    } else if (batch.length === 1) fail(batch, problem);
    else {
      const half = batch.length >> 1; // one of them is refused: find out which
      await this.send(batch.slice(0, half), stopped);
      if (!stopped.aborted) await this.send(batch.slice(half), stopped);
      else for (const upload of batch.slice(half)) upload.at.value = { is: "stopped", work: null };
    }
  }

  /** Nobody took it: try again as soon as the service is back, unless it is the file that is gone. */
  private async sendLater(batch: readonly Upload[], problem: Problem, stopped: AbortSignal): Promise<void> {
    for (const upload of batch) {
      upload.tries++;
      if (!(await isReadable(upload.file))) {
        upload.at.value = { is: "failed", reason: "The file cannot be read any more; choose it again.", work: null };
      } else if (upload.tries >= TRIES) fail([upload], problem);
      else if (stopped.aborted) upload.at.value = { is: "stopped", work: null };
      else {
        upload.at.value = { is: "waiting" };
        this.queue.unshift(upload);
      }
    }
    await serviceIsBack(stopped);
  }
}

/** What a file that failed or was stopped was computed in; null if it was not sent. */
function workOf({ at: { value } }: Upload): Work | null {
  return value.is === "failed" || value.is === "stopped" ? value.work : null;
}

/** All that was skipped; a job that was tried again is one job. */
function skippedIn(unsent: readonly Skipped[], works: readonly Work[]): { files: Skipped[]; count: number } {
  const jobs = new Map(works.map(({ job }) => [job.value.id, job.value]));
  const named = [...jobs.values()].flatMap(({ skipped }) => skipped);
  const number = [...jobs.values()].reduce((sum, { skipped_count }) => sum + skipped_count, 0);
  return { files: [...unsent, ...named], count: unsent.length + number };
}

function grouped(uploads: readonly Upload[]): Map<At["is"], Upload[]> {
  const groups = new Map<At["is"], Upload[]>();
  for (const upload of uploads) {
    const { is } = upload.at.value;
    const group = groups.get(is);
    if (group) group.push(upload);
    else groups.set(is, [upload]);
  }
  return groups;
}

function fail(uploads: readonly Upload[], problem: Problem): void {
  for (const upload of uploads) upload.at.value = { is: "failed", reason: sentence(problem.message), work: null };
}

async function isReadable(file: File): Promise<boolean> {
  return file
    .slice(0, 1)
    .arrayBuffer()
    .then(
      () => true,
      () => false,
    );
}

/** Ask until the service can work again, or there is nothing to be sent any more. */
async function serviceIsBack(stopped: AbortSignal): Promise<void> {
  for (let isBack = false; !isBack && !stopped.aborted;) {
    await pause(AWAY_MILLISECONDS);
    isBack = await ask("readyz").then(
      () => true,
      () => false,
    );
  }
}

const known = signal<readonly Uploads[]>([]);

/** Uploads to a collection, made when they are first asked for. */
export function uploadsTo(collection: string): Uploads {
  const found = known.peek().find((uploads) => uploads.collection === collection);
  if (found) return found;
  const made = new Uploads(collection);
  known.value = [...known.peek(), made];
  return made;
}

/** A collection has another name: what is still to be sent goes there. */
export function renameUploads(before: string, after: string): void {
  for (const uploads of known.peek()) if (uploads.collection === before) uploads.collection = after;
}

window.addEventListener("beforeunload", (event) => {
  if (known.peek().some((uploads) => uploads.isSending.value)) event.preventDefault();
});
