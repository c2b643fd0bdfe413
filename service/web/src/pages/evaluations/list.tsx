// The list of evaluations, the newest first.

import { useCallback } from "preact/hooks";
import type { Evaluation } from "../../api/types";
import { linkTo } from "../../router";
import { Badge, Empty, Heading, Trouble } from "../../ui/basics";
import { useLive } from "../../ui/live";
import { useEvery } from "../../ui/loading";
import { ago } from "../../ui/words";
import { bestModel } from "./best";
import { figure } from "./words";

const PAGE = 50;
const SOON_MILLISECONDS = 3000;

export function EvaluationList() {
  const list = useLive<Evaluation>("v1/evaluations", {}, PAGE, "first");
  const items = list.items.value;
  const refresh = useCallback(() => void list.refresh(goesOn), [list]);
  useEvery(items.some(goesOn) ? SOON_MILLISECONDS : null, refresh);
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
      <Trouble problem={list.problem.value} again={list.again} />
      {list.isLoading.value && <p class="loading">Loading…</p>}
      {list.isWhole.value && items.length === 0 && <NoneYet />}
      {items.length > 0 && <Table items={items} />}
      {!list.isWhole.value && items.length > 0 && (
        <button type="button" onClick={() => void list.more()}>
          Show older ones
        </button>
      )}
    </>
  );
}

function goesOn(evaluation: Evaluation): boolean {
  return evaluation.state === "queued" || evaluation.state === "running";
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
