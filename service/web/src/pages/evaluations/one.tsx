// One evaluation: how it goes on, why it failed, or what it found.

import { useState } from "preact/hooks";
import { ask } from "../../api/client";
import { hasEnded } from "../../api/jobs";
import type { Evaluation, Job } from "../../api/types";
import { linkTo } from "../../router";
import { Badge, Heading, JobBar, Trouble } from "../../ui/basics";
import { useLoad } from "../../ui/loading";
import { notifyProblem } from "../../ui/toasts";
import { useJob } from "../../ui/watching";
import { ago, count } from "../../ui/words";
import { ErrorList } from "../models/source";
import { hasTable } from "./best";
import { ByLabel, MeasuresTable } from "./measures";
import { Recall } from "./recall";
import { Skipped } from "./skipped";
import { Strengths } from "./strengths";
import { Table1 } from "./table";
import { DISSIMILARITIES } from "./words";
import { Worst } from "./worst";

export function OneEvaluation(props: { id: string }) {
  const { id } = props;
  const found = useLoad<Evaluation>((signal) => ask(`v1/evaluations/${encodeURIComponent(id)}`, { signal }), [id]);
  const evaluation = found.value;
  if (evaluation === null) {
    if (found.problem === null) return <p class="loading">Loading…</p>;
    return (
      <>
        <Heading title="Evaluation" hint={<a href={linkTo(["evaluations"])}>All evaluations</a>} />
        <Trouble problem={found.problem} again={found.again} />
      </>
    );
  }
  return (
    <>
      <Head evaluation={evaluation} />
      {evaluation.state === "succeeded" ? (
        <Results evaluation={evaluation} />
      ) : (
        <Progress evaluation={evaluation} changed={found.again} />
      )}
    </>
  );
}

function Head(props: { evaluation: Evaluation }) {
  const { evaluation } = props;
  const { collection, models, dissimilarity } = evaluation;
  const by = DISSIMILARITIES.find(([key]) => key === dissimilarity)?.[1] ?? dissimilarity;
  const hint = (
    <>
      <a href={linkTo(["evaluations"])}>Evaluations</a> · on{" "}
      <a href={linkTo(["collections", collection])}>{collection}</a> · <Badge state={evaluation.state} /> · begun{" "}
      <time dateTime={evaluation.created_at} title={new Date(evaluation.created_at).toLocaleString()}>
        {ago(evaluation.created_at)}
      </time>
      {by && <> · all channels compared by {by}</>}
    </>
  );
  return (
    <Heading title={title(models, collection)} hint={hint}>
      <a class="button" href={linkTo(["evaluations"], { new: 1, collection, models: models.join(",") })}>
        Evaluate again
      </a>
    </Heading>
  );
}

function title(models: string[], collection: string): string {
  const what = models.length > 3 ? count(models.length, "model") : models.join(", ");
  return `${what} on ${collection}`;
}

function Progress(props: { evaluation: Evaluation; changed: () => void }) {
  const { evaluation, changed } = props;
  const [turn, setTurn] = useState(0);
  const { job, problem } = useJob(evaluation.job_id, changed, turn);
  const act = async (what: "cancel" | "retry") => {
    try {
      await ask<Job>(`v1/jobs/${evaluation.job_id}/${what}`, { method: "POST" });
      setTurn((before) => before + 1);
      changed();
    } catch (error) {
      notifyProblem(error);
    }
  };
  if (job === null) return problem ? <Trouble problem={problem} /> : <p class="loading">Loading…</p>;
  const goesOn = !hasEnded(job);
  return (
    <section class="panel">
      <h2>{goesOn ? "It goes on" : job.state === "cancelled" ? "It was cancelled" : "It failed"}</h2>
      {goesOn && (
        <>
          <JobBar job={job} label="progress of the evaluation" />
          <p class="quiet">
            Shapes are described under models that they were not described under yet; then every query is ranked. You
            can leave this page.
          </p>
        </>
      )}
      {job.errors.length > 0 && <ErrorList errors={job.errors} />}
      <button type="button" class={goesOn ? "" : "main"} onClick={() => void act(goesOn ? "cancel" : "retry")}>
        {goesOn ? "Cancel it" : "Try again"}
      </button>
    </section>
  );
}

function Results(props: { evaluation: Evaluation }) {
  const { evaluation } = props;
  return (
    <>
      <p class="lead">{protocol(evaluation)}</p>
      {hasTable(evaluation) && <Table1 evaluation={evaluation} />}
      <MeasuresTable evaluation={evaluation} />
      {hasTable(evaluation) && <Strengths evaluation={evaluation} />}
      <div class="columns apart">
        <Recall evaluation={evaluation} />
        <ByLabel evaluation={evaluation} />
      </div>
      <Worst evaluation={evaluation} />
      <Skipped skipped={evaluation.skipped} />
    </>
  );
}

/** What was asked and what could be found. */
function protocol(evaluation: Evaluation): string {
  const queries = count(evaluation.n_queries ?? 0, "shape");
  const targets = count(evaluation.n_targets ?? 0, "shape");
  return evaluation.leave_one_out
    ? `${queries} were asked with, each against all ${targets} but itself. Right is what has its label. ` +
        "There is no table of transformations, since no shape of the collection is named as one."
    : `${queries} that were transformed were asked with against ${targets} that were not. Right is what has the same ` +
        "label. All figures are in per cent.";
}
