// A request's files after they were sent: their job, followed until each of them is ready or has failed.

import { signal, type Signal } from "@preact/signals";
import { ask, Problem } from "../../api/client";
import { hasEnded, pause, watchJob } from "../../api/jobs";
import type { Job, JobError, Shape } from "../../api/types";
import { sentence } from "../../ui/basics";
import { asProblem } from "../../ui/loading";
import { count, fileName } from "../../ui/words";
import { cleanPath } from "./batches";
import type { Sent } from "./files";
import { isArchive } from "./kinds";
import { each, Turns } from "./pool";
import { tryAgain } from "./retry";

/** Where a file of an upload is. */
export type At =
  | { is: "waiting" }
  | { is: "sending"; share: Signal<number> }
  | { is: "computing"; work: Work }
  | { is: "ready"; shape: string | null; text: string }
  | { is: "failed"; reason: string; work: Work | null }
  /** Sending it, or its job, was stopped. */
  | { is: "stopped"; work: Work | null };

export interface Upload extends Sent {
  readonly id: number;
  readonly at: Signal<At>;
  tries: number;
}

export interface Part {
  upload: Upload;
  /** Null for an archive, of which many come, and where it is not known which file a shape is of. */
  shape: Shape | null;
}

const AGAIN_MILLISECONDS = 3000;
const AT_ONCE = 4;
const forever = new AbortController().signal;
const watched = new Turns(2); // a browser opens six connections to a service, and each watching takes one

export class Work {
  readonly job: Signal<Job>;
  private isAsking = false;

  constructor(
    job: Job,
    private readonly parts: readonly Part[],
  ) {
    this.job = signal(job);
    for (const { upload, shape } of parts) {
      upload.at.value = { is: "computing", work: this };
      if (shape !== null) this.place(upload, shape, "was there already");
    }
    void this.follow();
  }

  async cancel(): Promise<void> {
    if (hasEnded(this.job.value)) return;
    try {
      this.job.value = await ask<Job>(`v1/jobs/${this.job.value.id}/cancel`, { method: "POST" });
    } catch (error) {
      if (!(error instanceof Problem) || error.status !== 409) throw error; // it has ended meanwhile
    }
  }

  /** Compute again what failed of it; null where there is no job any more that could. */
  async retry(): Promise<Work | null> {
    const failed = this.parts.filter(({ upload }) => hasFailed(upload.at.value, this));
    const job = await ask<Job>(`v1/jobs/${this.job.value.id}/retry`, { method: "POST" }).catch((error: unknown) => {
      if (error instanceof Problem && error.status === 409 && hasEnded(this.job.value)) return null;
      throw error;
    });
    const again = job ?? (await this.retryElsewhere(failed));
    if (again === null) return null;
    return new Work(
      again,
      failed.map(({ upload, shape }) => ({ upload, shape: asQueued(shape) })),
    );
  }

  /** What was there already had failed in an earlier job. */
  private async retryElsewhere(failed: readonly Part[]): Promise<Job | null> {
    let last: Job | null = null;
    for (const { shape } of failed) {
      if (shape === null) continue;
      const now = await ask<Shape>(`v1/shapes/${shape.id}`);
      if (now.state === "failed") last = (await tryAgain(now)) ?? last;
    }
    return last;
  }

  private async follow(): Promise<void> {
    try {
      const report = (job: Job) => {
        this.job.value = job;
        void this.settle(job).catch(() => {}); // asked again at the next change, and at the end
      };
      if (!hasEnded(this.job.value)) await watched.take(() => this.watch(report));
      await this.finish();
    } catch (error) {
      const reason = sentence(asProblem(error).message);
      for (const { upload } of this.open()) upload.at.value = { is: "failed", reason, work: this };
    }
  }

  /** Once it is its turn; it may have been cancelled before. */
  private async watch(report: (job: Job) => void): Promise<void> {
    if (!hasEnded(this.job.value)) await watchJob(this.job.value.id, report, forever);
  }

  private open(): Part[] {
    const isOpen = (at: At) => at.is === "computing" && at.work === this;
    return this.parts.filter(({ upload }) => isOpen(upload.at.value));
  }

  /** Ask after shapes in their order, until as many are settled as the job says. */
  private async settle(job: Job): Promise<void> {
    if (this.isAsking) return;
    this.isAsking = true;
    try {
      for (const part of this.open()) {
        if (this.parts.length - this.open().length >= job.progress.done) break;
        await this.look(part);
      }
    } finally {
      this.isAsking = false;
    }
  }

  /** The job has ended: ask after what is left, which may be with another job still. */
  private async finish(): Promise<void> {
    for (const part of this.open()) if (part.shape === null) this.placeByJob(part.upload);
    while (this.open().length > 0) {
      await each(this.open(), AT_ONCE, (part) =>
        this.look(part).catch((error: unknown) => {
          if (!asProblem(error).isAway) throw error;
        }),
      );
      if (this.open().length > 0) await pause(AGAIN_MILLISECONDS);
    }
  }

  private async look(part: Part): Promise<void> {
    if (part.shape === null) return;
    try {
      this.place(part.upload, await ask<Shape>(`v1/shapes/${part.shape.id}`));
    } catch (error) {
      if (!(error instanceof Problem) || error.status !== 404) throw error;
      part.upload.at.value = { is: "failed", reason: "It was deleted meanwhile.", work: null };
    }
  }

  private place(upload: Upload, shape: Shape, text = "ready"): void {
    if (shape.state === "ready") upload.at.value = { is: "ready", shape: shape.id, text };
    if (shape.state !== "failed") return;
    if (shape.error?.type === "cancelled") upload.at.value = { is: "stopped", work: this };
    else {
      upload.at.value = { is: "failed", reason: sentence(shape.error?.detail ?? "no reason is known"), work: this };
    }
  }

  private placeByJob(upload: Upload): void {
    const { errors, progress, state } = this.job.value;
    const path = cleanPath(upload.name);
    const own = isArchive(upload.name)
      ? errors
      : errors.filter(({ item }) => item === path || item === fileName(path));
    if (state === "cancelled") upload.at.value = { is: "stopped", work: this };
    else if (own.length > 0) upload.at.value = { is: "failed", reason: inWords(own, progress.total), work: this };
    else {
      const text = isArchive(upload.name) ? `${count(progress.total, "shape")} ready` : "ready";
      upload.at.value = { is: "ready", shape: null, text };
    }
  }
}

function hasFailed(at: At, work: Work): boolean {
  return (at.is === "failed" || at.is === "stopped") && at.work === work;
}

function inWords(errors: readonly JobError[], total: number): string {
  const [first] = errors;
  if (first === undefined) return "";
  if (errors.length === 1)
    return total > 1 ? `1 of ${total} failed: ${first.item}: ${sentence(first.detail)}` : sentence(first.detail);
  return `${errors.length} of ${total} failed; the first, ${first.item}: ${sentence(first.detail)}`;
}

function asQueued(shape: Shape | null): Shape | null {
  return shape === null ? null : { ...shape, state: "queued", error: null };
}
