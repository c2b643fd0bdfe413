// One job: how far it is, and what failed in it.

import { useEffect, useState } from "preact/hooks";
import { ask } from "../../api/client";
import { hasEnded, watchJob } from "../../api/jobs";
import type { Job } from "../../api/types";
import { linkTo } from "../../router";
import { Badge, Heading, JobBar, sentence, Trouble } from "../../ui/basics";
import { asProblem, useEvery, useLoad } from "../../ui/loading";
import { notifyProblem } from "../../ui/toasts";
import { SkippedFiles } from "../../ui/skipped";
import { count, duration } from "../../ui/words";
import { JobButtons } from "./buttons";
import { STATES, titleOf } from "./words";

const MOST_ERRORS = 1000;
const TICK_MILLISECONDS = 1000;

export function OneJob(props: { id: string }) {
  const loaded = useLoad<Job>((signal) => ask(`v1/jobs/${encodeURIComponent(props.id)}`, { signal }), [props.id]);
  return (
    <>
      <nav class="crumbs" aria-label="Where this is">
        <a href={linkTo(["jobs"])}>Jobs</a>
      </nav>
      {loaded.value !== null ? (
        <Watched begun={loaded.value} />
      ) : loaded.problem ? (
        <Trouble problem={loaded.problem} again={loaded.again} />
      ) : (
        <p class="loading">Loading…</p>
      )}
    </>
  );
}

function Watched(props: { begun: Job }) {
  const [job, setJob] = useState(props.begun);
  const [, tick] = useState(0);
  const isOpen = !hasEnded(job);
  useEffect(() => {
    if (!isOpen) return;
    const abort = new AbortController();
    watchJob(props.begun.id, setJob, abort.signal).catch((error: unknown) => {
      if (!abort.signal.aborted) notifyProblem(asProblem(error));
    });
    return () => abort.abort();
  }, [props.begun.id, isOpen]);
  useEvery(isOpen ? TICK_MILLISECONDS : null, () => tick((before) => before + 1));
  return (
    <>
      <Heading title={titleOf(job)} hint={<Badge state={job.state}>{STATES[job.state]}</Badge>}>
        <JobButtons job={job} changed={setJob} />
      </Heading>
      <section class="panel" aria-label="How far it is">
        {isOpen && <JobBar job={job} label={titleOf(job)} />}
        <Facts job={job} />
      </section>
      <Errors job={job} />
      {job.skipped_count > 0 && (
        <section class="panel" aria-label="What was skipped">
          <SkippedFiles files={job.skipped} count={job.skipped_count} />
        </section>
      )}
    </>
  );
}

function Facts(props: { job: Job }) {
  const { job } = props;
  const { done, total, unit } = job.progress;
  return (
    <dl class="facts">
      {hasEnded(job) && (
        <>
          <dt>Done</dt>
          <dd>
            {done} of {total} {unit}
          </dd>
        </>
      )}
      {job.collection !== null && (
        <>
          <dt>Collection</dt>
          <dd>
            <a href={linkTo(["collections", job.collection])}>{job.collection}</a>
          </dd>
        </>
      )}
      {job.model !== null && (
        <>
          <dt>Model</dt>
          <dd>
            <a href={linkTo(["models", job.model])}>{job.model}</a>
          </dd>
        </>
      )}
      <dt>Asked for</dt>
      <dd>{inFull(job.created_at)}</dd>
      <dt>Begun</dt>
      <dd>{job.started_at === null ? "not yet" : inFull(job.started_at)}</dd>
      <dt>Ended</dt>
      <dd>{job.finished_at === null ? "not yet" : inFull(job.finished_at)}</dd>
      {job.started_at !== null && (
        <>
          <dt>Time taken</dt>
          <dd>{duration(job.started_at, job.finished_at)}</dd>
        </>
      )}
      <dt>Attempts</dt>
      <dd>{job.attempts}</dd>
    </dl>
  );
}

function inFull(time: string): string {
  return new Date(time).toLocaleString("en", { dateStyle: "medium", timeStyle: "medium" });
}

function Errors(props: { job: Job }) {
  const { errors } = props.job;
  if (errors.length === 0) return null;
  return (
    <section class="panel">
      <h2>{count(errors.length, "error")}</h2>
      {errors.length >= MOST_ERRORS && <p class="quiet">These are the first thousand.</p>}
      <div class="scrolled">
        <table class="errors">
          <thead>
            <tr>
              <th scope="col">What failed</th>
              <th scope="col">Why</th>
            </tr>
          </thead>
          <tbody>
            {errors.map((error, place) => (
              <tr key={place}>
                <td>{error.item}</td>
                <td>{sentence(error.detail)}</td>
              </tr>
            ))}
          </tbody>
        </table>
      </div>
    </section>
  );
}
