// The list of evaluations, the newest first.

import type { Evaluation } from "../../api/types";
import { linkTo } from "../../router";
import { Badge, Empty, Heading, Trouble } from "../../ui/basics";
import { useEvery } from "../../ui/loading";
import { usePaged } from "../../ui/pages";
import { ago } from "../../ui/words";
import { bestModel } from "./best";
import { figure } from "./words";

const AGAIN_MILLISECONDS = 3000;

export function EvaluationList() {
  const evaluations = usePaged<Evaluation>("v1/evaluations", {}, 50);
  const { items } = evaluations;
  const goesOn = items.some((one) => one.state === "queued" || one.state === "running");
  useEvery(goesOn || evaluations.problem?.isAway ? AGAIN_MILLISECONDS : null, evaluations.again);
  return (
    <>
      <Heading
        title="Evaluations"
        hint="How well models find again what belongs together, on a collection whose shapes have labels."
      >
        <a class="button main" href={linkTo(["evaluations"], { new: 1 })}>
          Evaluate models
        </a>
      </Heading>
      <Trouble problem={evaluations.problem} again={evaluations.again} />
      {items.length === 0 && evaluations.isLoading && <p class="loading">Loading…</p>}
      {items.length === 0 && !evaluations.isLoading && evaluations.problem === null && <NoneYet />}
      {items.length > 0 && <Table items={items} />}
      {!evaluations.isWhole && items.length > 0 && (
        <button type="button" onClick={evaluations.more} disabled={evaluations.isLoading}>
          Show more
        </button>
      )}
    </>
  );
}

function NoneYet() {
  return (
    <Empty title="Nothing has been evaluated yet">
      <p>
        Give the shapes of a collection labels, or name their files like <code>cat.holes.3.off</code>: a cat, with
        holes, of strength 3. Then models can be measured on it.
      </p>
      <a class="button main" href={linkTo(["evaluations"], { new: 1 })}>
        Evaluate models
      </a>
    </Empty>
  );
}

function Table(props: { items: Evaluation[] }) {
  return (
    <div class="panel scrolled">
      <table class="whole">
        <caption class="unseen">Evaluations, the newest first</caption>
        <thead>
          <tr>
            <th scope="col">Collection</th>
            <th scope="col">Models</th>
            <th scope="col">State</th>
            <th scope="col">Best</th>
            <th scope="col">Queries</th>
            <th scope="col">Begun</th>
          </tr>
        </thead>
        <tbody>
          {props.items.map((one) => (
            <Row key={one.id} evaluation={one} />
          ))}
        </tbody>
      </table>
    </div>
  );
}

function Row(props: { evaluation: Evaluation }) {
  const { evaluation } = props;
  const best = bestModel(evaluation);
  return (
    <tr>
      <th scope="row">
        <a href={linkTo(["evaluations", evaluation.id])}>{evaluation.collection}</a>
      </th>
      <td>
        {evaluation.models.join(", ")}
        {evaluation.dissimilarity && <span class="quiet"> by {evaluation.dissimilarity}</span>}
      </td>
      <td>
        <Badge state={evaluation.state} />
      </td>
      <td>{best === null ? "" : `${best.model}, ${figure(best.mean)} %`}</td>
      <td>{evaluation.n_queries ?? ""}</td>
      <td>
        <time dateTime={evaluation.created_at} title={new Date(evaluation.created_at).toLocaleString()}>
          {ago(evaluation.created_at)}
        </time>
      </td>
    </tr>
  );
}
