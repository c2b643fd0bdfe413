// What a job is at, as people say it.

import type { Job } from "../api/types";
import { about } from "./words";

const STEPS: Record<string, string> = {
  reading: "reading the mesh",
  simplifying: "simplifying the mesh",
  spectrum: "computing its spectrum",
  describing: "describing it",
  matching: "matching its points",
  searching: "searching",
  transforming: "transforming a shape",
  learning: "learning",
  measuring: "measuring",
};

/** How far a job is, in words: what is done now, and how many of several are done. */
export function standOf(job: Pick<Job, "state" | "step" | "seconds_left" | "progress">): string {
  if (job.state === "queued") return "waiting for a worker";
  const { done, total, unit } = job.progress;
  const step = job.step === null ? null : STEPS[job.step] ?? job.step;
  if (step !== null && total === 1) return step;
  const left = job.seconds_left === null ? null : `${about(job.seconds_left)} left`;
  return [`${done} of ${total} ${unit}`, step, left].filter((part) => part !== null).join(", ");
}
