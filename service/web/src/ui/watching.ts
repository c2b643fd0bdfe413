// A hook that watches long work: a job as it goes on, until it has ended.

import { useEffect, useState } from "preact/hooks";
import type { Problem } from "../api/client";
import { watchJob } from "../api/jobs";
import type { Job } from "../api/types";
import { asProblem } from "./loading";

/** The newest state of a job; `null` as id watches nothing. `ended` gets its last state. */
export function useJob(
  id: string | null,
  ended?: (job: Job) => void,
  turn = 0,
): { job: Job | null; problem: Problem | null } {
  const [job, setJob] = useState<Job | null>(null);
  const [problem, setProblem] = useState<Problem | null>(null);
  useEffect(() => {
    setJob(null);
    setProblem(null);
    if (id === null) return;
    const abort = new AbortController();
    watchJob(id, setJob, abort.signal)
      .then((last) => !abort.signal.aborted && ended?.(last))
      .catch((error: unknown) => !abort.signal.aborted && setProblem(asProblem(error)));
    return () => abort.abort();
  }, [id, turn]);
  return { job: job !== null && job.id === id ? job : null, problem };
}
