// What can be done with a job: cancel it, or try again what failed.

import { useState } from "preact/hooks";
import { ask } from "../../api/client";
import { hasEnded } from "../../api/jobs";
import type { Job } from "../../api/types";
import { notifyProblem } from "../../ui/toasts";
import { titleOf } from "./words";

export function JobButtons(props: { job: Job; changed: (job: Job) => void }) {
  const { job } = props;
  const [isBusy, setBusy] = useState(false);
  const act = async (what: "cancel" | "retry") => {
    setBusy(true);
    try {
      props.changed(await ask<Job>(`v1/jobs/${job.id}/${what}`, { method: "POST" }));
    } catch (error) {
      notifyProblem(error);
      await ask<Job>(`v1/jobs/${job.id}`).then(props.changed, () => {}); // it is not as it was shown
    } finally {
      setBusy(false);
    }
  };
  if (!hasEnded(job)) {
    return (
      <button
        type="button"
        class="small"
        disabled={isBusy}
        aria-label={`Cancel: ${titleOf(job)}`}
        onClick={() => void act("cancel")}
      >
        Cancel
      </button>
    );
  }
  if (job.state === "succeeded" && job.errors.length === 0) return null;
  return (
    <button
      type="button"
      class="small"
      disabled={isBusy}
      aria-label={`Try again: ${titleOf(job)}`}
      onClick={() => void act("retry")}
    >
      Try again
    </button>
  );
}
