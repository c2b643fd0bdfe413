// A model that is not ready: how its training goes on, or why it failed.

import { useState } from "preact/hooks";
import { ask } from "../../api/client";
import { hasEnded } from "../../api/jobs";
import type { Job, Model } from "../../api/types";
import { linkTo } from "../../router";
import { JobBar, Trouble } from "../../ui/basics";
import { useLoad } from "../../ui/loading";
import { notifyProblem } from "../../ui/toasts";
import { useJob } from "../../ui/watching";
import { duration } from "../../ui/words";
import { findTraining } from "./load";
import { ErrorList, SourceSentence } from "./source";
import { sourceOf } from "./reports";

export function Training(props: { model: Model; changed: () => void }) {
  const { model, changed } = props;
  const found = useLoad((signal) => findTraining(model.name, signal), [model.name]);
  const [turn, setTurn] = useState(0);
  const watched = useJob(found.value?.id ?? null, changed, turn);
  const job = watched.job ?? found.value;
  const act = async (what: "cancel" | "retry") => {
    try {
      await ask<Job>(`v1/jobs/${job!.id}/${what}`, { method: "POST" });
      setTurn((before) => before + 1);
      changed();
    } catch (error) {
      notifyProblem(error);
    }
  };
  return (
    <section class="panel" aria-labelledby="training">
      <h2 id="training">{titleOf(model, job)}</h2>
      {model.training !== null && <SourceSentence source={sourceOf(model.training)} />}
      <Trouble problem={found.problem ?? watched.problem} again={found.again} />
      {job === null && !found.isLoading && found.problem === null && (
        <p class="quiet">Its job is not known any more. Delete it and train it again.</p>
      )}
      {job !== null && (model.state === "failed" ? <Failed job={job} act={act} /> : <Going job={job} act={act} />)}
    </section>
  );
}

function titleOf(model: Model, job: Job | null): string {
  if (model.state !== "failed") return "It is in training";
  return job?.state === "cancelled" ? "Its training was cancelled" : "Its training failed";
}

interface JobProps {
  job: Job;
  act: (what: "cancel" | "retry") => Promise<void>;
}

function Going(props: JobProps) {
  const { job, act } = props;
  const { done, total } = job.progress;
  const fits = total > 0 && done >= total && !hasEnded(job);
  return (
    <>
      <JobBar job={job} label="progress of the training" />
      <p class="quiet" role="status">
        {job.started_at ? `Begun ${duration(job.started_at, null)} ago.` : "It begins when a worker is free."}
        {fits && " All is computed; the model is being fitted."} You can leave this page, it goes on.
      </p>
      {job.errors.length > 0 && <ErrorList errors={job.errors} />}
      <button type="button" onClick={() => void act("cancel")}>
        Cancel the training
      </button>
    </>
  );
}

function Failed(props: JobProps) {
  const { job, act } = props;
  return (
    <>
      {job.state === "cancelled" && <p>What was computed is kept; tried again, it goes on from there.</p>}
      {job.errors.length > 0 && <ErrorList errors={job.errors} />}
      <div class="row">
        <button type="button" class="main" onClick={() => void act("retry")}>
          Try again
        </button>
        <a href={linkTo(["jobs"])}>All jobs</a>
      </div>
    </>
  );
}
