// The model that a collection is searched under, and moving it to another.

import { useEffect, useState } from "preact/hooks";
import { ask, queryText, type Problem } from "../../api/client";
import { hasEnded, watchJob } from "../../api/jobs";
import type { Collection, Job, Page } from "../../api/types";
import { linkTo } from "../../router";
import { Field, JobBar, sentence, Trouble } from "../../ui/basics";
import { asProblem } from "../../ui/loading";
import { notify } from "../../ui/toasts";
import { ModelSelect } from "./fields";

export function MovePanel(props: { collection: Collection; moved: () => void }) {
  const { collection, moved } = props;
  const [job, setJob] = useState<Job | null>(null);
  const [problem, setProblem] = useState<Problem | null>(null);
  const moving = job !== null && !hasEnded(job);
  useEffect(() => {
    const abort = new AbortController();
    unfinishedMove(collection.name, abort.signal).then(
      (found) => !abort.signal.aborted && setJob((begun) => begun ?? found),
      () => {}, // the warning that a move is running is left out where it cannot be had
    );
    return () => abort.abort();
  }, [collection.name]);
  useEffect(() => {
    if (job === null || hasEnded(job)) return;
    const abort = new AbortController();
    watchJob(job.id, (now) => !hasEnded(now) && setJob(now), abort.signal)
      .then((ended) => {
        setJob(ended);
        if (ended.state === "succeeded") notify(`${collection.name} is searched under ${ended.model} now`);
        moved();
      })
      .catch((error: unknown) => !abort.signal.aborted && setProblem(asProblem(error)));
    return () => abort.abort();
  }, [job?.id, moving]);
  const begin = async (model: string) => {
    setProblem(null);
    try {
      const answer = await ask<{ job: Job }>(`v1/collections/${collection.name}/model`, {
        method: "PUT",
        json: { model },
      });
      setJob(answer.job);
      if (hasEnded(answer.job)) moved();
    } catch (error) {
      setProblem(asProblem(error));
    }
  };
  return (
    <section class="panel move" aria-label="Model">
      <p>
        Searched under <a href={linkTo(["models", collection.model])}>{collection.model}</a>
      </p>
      <Trouble problem={problem} />
      {moving ? <Moving job={job} /> : <Choice key={collection.model} collection={collection} begin={begin} />}
      {job !== null && job.state === "failed" && <Failed job={job} />}
    </section>
  );
}

async function unfinishedMove(collection: string, signal: AbortSignal): Promise<Job | null> {
  const query = queryText({ collection, kind: "describe", limit: 5 });
  const page = await ask<Page<Job>>(`v1/jobs${query}`, { signal });
  return page.items.find((job) => !hasEnded(job)) ?? null;
}

function Choice(props: { collection: Collection; begin: (model: string) => Promise<void> }) {
  const [model, setModel] = useState("");
  const [isBusy, setBusy] = useState(false);
  const begin = () => {
    setBusy(true);
    void props.begin(model).finally(() => setBusy(false));
  };
  return (
    <form
      class="row"
      onSubmit={(event) => {
        event.preventDefault();
        begin();
      }}
    >
      <Field label="Move it to">
        {(id) => (
          <ModelSelect id={id} value={model} set={setModel} none="another model…" without={props.collection.model} />
        )}
      </Field>
      <button type="submit" disabled={model === "" || isBusy}>
        Move
      </button>
    </form>
  );
}

function Moving(props: { job: Job }) {
  return (
    <div class="moving">
      <p>
        <a href={linkTo(["jobs", props.job.id])}>Moving to {props.job.model}</a>. Searches go on as before until it is
        done.
      </p>
      <JobBar job={props.job} label={`moving to ${props.job.model}`} />
    </div>
  );
}

function Failed(props: { job: Job }) {
  const last = props.job.errors.at(-1);
  return (
    <div class="trouble" role="alert">
      <strong>It could not be moved to {props.job.model}</strong>
      <p>{last ? sentence(last.detail) : "No reason is known."}</p>
      <a href={linkTo(["jobs", props.job.id])}>The job and all its reasons</a>
    </div>
  );
}
