// Jobs as people say them.

import type { Job, JobKind, State } from "../../api/types";

export const KINDS: Record<JobKind, string> = {
  ingest: "Computing shapes",
  query: "Answering a query",
  train: "Training a model",
  describe: "Moving a collection to a model",
  evaluate: "Measuring models",
  prune: "Freeing space",
  correspondence: "Matching points",
};

export const STATES: Record<State, string> = {
  queued: "waiting",
  running: "at work",
  succeeded: "done",
  failed: "failed",
  cancelled: "cancelled",
};

export function titleOf(job: Job): string {
  if (job.kind === "train" && job.model) return `Training ${job.model}`;
  if (job.kind === "describe" && job.collection && job.model) return `Moving ${job.collection} to ${job.model}`;
  return KINDS[job.kind];
}

export function isKind(text: string | null): text is JobKind {
  return text !== null && Object.hasOwn(KINDS, text);
}

export function isState(text: string | null): text is State {
  return text !== null && Object.hasOwn(STATES, text);
}
