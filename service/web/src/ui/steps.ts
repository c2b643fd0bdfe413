// What a job is at, as people say it.

import type { Job } from "../api/types";

const STEPS: Record<string, string> = {
  reading: "reading the mesh",
  simplifying: "simplifying the mesh",
  spectrum: "computing its spectrum",
  describing: "describing it",
  searching: "searching",
  transforming: "transforming a shape",
  learning: "learning",
  measuring: "measuring",
};

/** How far a job is, in words: what is done now, and how many of several are done. */
export function standOf(job: Pick<Job, "state" | "step" | "progress">): string {
  if (job.state === "queued") return "waiting for a worker";
  const { done, total, unit } = job.progress;
  const step = job.step === null ? null : STEPS[job.step] ?? job.step;
  if (step !== null && total === 1) return step;
  return step === null ? `${done} of ${total} ${unit}` : `${done} of ${total} ${unit}, ${step}`;
}
