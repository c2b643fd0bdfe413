// The queries that a model answers worst, with what it found first instead.

import { useState } from "preact/hooks";
import { ask, Problem } from "../../api/client";
import type { Evaluation, Shape } from "../../api/types";
import { linkTo } from "../../router";
import { Field, Thumbnail } from "../../ui/basics";
import { useLoad } from "../../ui/loading";
import { count, fileName } from "../../ui/words";
import { bestModel } from "./best";

const FEW = 6;
const FOUND = 3;

export function Worst(props: { evaluation: Evaluation }) {
  const { evaluation } = props;
  const { models, collection } = evaluation;
  const [chosen, setModel] = useState(bestModel(evaluation)?.model ?? models[0] ?? "");
  const [shown, setShown] = useState(FEW);
  const missed = evaluation.ranks
    .filter((row) => row.model === chosen && row.rank > 1)
    .sort((a, b) => b.rank - a.rank || a.query.localeCompare(b.query));
  const choose = (model: string) => {
    setModel(model);
    setShown(FEW);
  };
  return (
    <section class="panel" aria-labelledby="worst">
      <div class="headrow">
        <h2 id="worst">What is missed most</h2>
        {models.length > 1 && <ModelChoice models={models} chosen={chosen} choose={choose} />}
      </div>
      <p class="quiet" role="status">
        {missed.length === 0
          ? `With ${chosen} every query finds something right first.`
          : `With ${chosen} ${count(missed.length, "query finds", "queries find")} something wrong first.`}
      </p>
      <ul class="worst">
        {missed.slice(0, shown).map((row) => (
          <li key={row.query}>
            <Missed row={row} collection={collection} />
          </li>
        ))}
      </ul>
      {missed.length > shown && (
        <button type="button" class="small" onClick={() => setShown(shown + FEW)}>
          Show more
        </button>
      )}
    </section>
  );
}

function ModelChoice(props: { models: string[]; chosen: string; choose: (model: string) => void }) {
  return (
    <Field label="Model">
      {(id) => (
        <select id={id} value={props.chosen} onChange={(event) => props.choose(event.currentTarget.value)}>
          {props.models.map((model) => (
            <option key={model}>{model}</option>
          ))}
        </select>
      )}
    </Field>
  );
}

function Missed(props: { row: Evaluation["ranks"][number]; collection: string }) {
  const { query, model, rank, top } = props.row;
  return (
    <article class="missed">
      <div class="asked">
        <ShapePicture id={query} size={120} />
      </div>
      <div class="instead">
        <p class="quiet">The first right one is number {rank}. Before it:</p>
        <ol class="found">
          {top.slice(0, Math.min(FOUND, rank - 1)).map((id) => (
            <li key={id}>
              <ShapePicture id={id} size={72} />
            </li>
          ))}
        </ol>
        <a href={linkTo(["search", props.collection], { shape: query, model })}>See why</a>
      </div>
    </article>
  );
}

const known = new Map<string, Promise<Shape | null>>();

/** A shape by its id, asked for once; null if it was deleted. */
function findShape(id: string): Promise<Shape | null> {
  const found =
    known.get(id) ??
    ask<Shape>(`v1/shapes/${id}`).catch((error: unknown) => {
      if (error instanceof Problem && error.status === 404) return null;
      known.delete(id);
      throw error;
    });
  known.set(id, found);
  return found;
}

function ShapePicture(props: { id: string; size: number }) {
  const { id, size } = props;
  const found = useLoad(() => findShape(id), [id]);
  const shape = found.value;
  if (shape === null) {
    const said = found.isLoading ? "…" : found.problem ? "not loaded" : "deleted";
    return (
      <span class="picture">
        <span class="nopicture" style={{ width: `${size}px`, height: `${size}px` }} />
        <small class="quiet">{said}</small>
      </span>
    );
  }
  return (
    <a class="picture" href={linkTo(["shapes", id])} title={shape.name}>
      <Thumbnail shape={shape} size={size} />
      <small style={{ maxWidth: `${size + 12}px` }}>{fileName(shape.name)}</small>
    </a>
  );
}
