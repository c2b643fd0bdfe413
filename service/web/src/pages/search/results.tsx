// Ranked matches as cards, and what narrows them.

import { ask } from "../../api/client";
import type { Match, Model, Page, QueryResult } from "../../api/types";
import { change, linkTo, route } from "../../router";
import { Empty, Field, Similarity, Thumbnail } from "../../ui/basics";
import { AGAIN_MILLISECONDS, useEvery, useLoad } from "../../ui/loading";
import { brief, count, fileName } from "../../ui/words";
import { MOST_MATCHES, type Narrowing } from "./asking";
import { FilterRow } from "./filter_row";
import { DropZone } from "./start";

const FEW = 12;

interface Props {
  result: QueryResult;
  chosen: string | null;
  choose: (shape: string) => void;
  narrowing: Narrowing;
  narrow: (changed: (now: Narrowing) => Partial<Narrowing>) => void;
  send: (file: File) => void;
  /** Ask once more. */
  again: () => void;
  /** Whether a stored shape was asked with, which costs next to nothing. */
  isStored: boolean;
}

export function Results(props: Props) {
  const { result } = props;
  const wanted = Number(route.value.query.get("show")) || FEW;
  const shown = result.matches.slice(0, wanted);
  return (
    <section aria-label="Matches">
      <div class="panel tools">
        <DropZone send={props.send} isBusy={false} small />
        <HowMany wanted={wanted} most={Math.max(FEW, result.matches.length)} />
        <ModelChoice {...props} />
        <FilterRow
          tests={props.narrowing.tests}
          shapes={result.matches.map((match) => match.shape)}
          set={(changed) => props.narrow(({ tests }) => ({ tests: changed(tests) }))}
        />
      </div>
      <p class="quiet" role="status">
        {count(shown.length, "match", "matches")} of {count(result.searched, "shape")} searched in{" "}
        {result.took_ms < 10 ? result.took_ms.toFixed(1) : Math.round(result.took_ms)} ms, by <a href={linkTo(["models", result.model])}>{result.model}</a>
      </p>
      {shown.length === 0 ? (
        <NoMatches {...props} />
      ) : (
        <ol class="cards">
          {shown.map((match) => (
            <li key={match.shape.id}>
              <Card match={match} isChosen={match.shape.id === props.chosen} choose={() => props.choose(match.shape.id)} />
            </li>
          ))}
        </ol>
      )}
    </section>
  );
}

/** Filters that nothing passes, or a collection whose shapes are still being described. */
function NoMatches({ narrowing, narrow, again, isStored }: Props) {
  const isFiltered = narrowing.tests.length > 0;
  useEvery(isStored && !isFiltered ? AGAIN_MILLISECONDS : null, again);
  if (!isFiltered) {
    return (
      <Empty title="No other shape is ready yet">
        {isStored ? (
          <p>The search is repeated until there is one.</p>
        ) : (
          <p>
            <button type="button" onClick={again}>
              Search again
            </button>
          </p>
        )}
      </Empty>
    );
  }
  return (
    <Empty title="Nothing passes the filters">
      <p>
        <button type="button" onClick={() => narrow(() => ({ tests: [] }))}>
          Search without filters
        </button>
      </p>
    </Empty>
  );
}

function Card(props: { match: Match; isChosen: boolean; choose: () => void }) {
  const { shape, rank, similarity, distance } = props.match;
  return (
    <button
      type="button"
      class={props.isChosen ? "card match chosen" : "card match"}
      aria-pressed={props.isChosen}
      title={`distance ${brief(distance)}`}
      onClick={props.choose}
    >
      <span class="rank">
        <span class="unseen">Rank </span>
        {rank}
      </span>
      <Thumbnail shape={shape} size={112} />
      <span class="name">{shape.label ?? fileName(shape.name)}</span>
      <small class="quiet name">{fileName(shape.name)}</small>
      <Similarity value={similarity} />
    </button>
  );
}

function HowMany(props: { wanted: number; most: number }) {
  const most = Math.min(MOST_MATCHES, props.most);
  const value = Math.min(props.wanted, most);
  return (
    <Field label={`Show ${value}`}>
      {(id) => (
        <input
          id={id}
          type="range"
          min={1}
          max={most}
          value={value}
          onInput={(event) => change({ show: event.currentTarget.value })}
        />
      )}
    </Field>
  );
}

function ModelChoice({ narrowing, narrow }: Props) {
  const models = useLoad((signal) => ask<Page<Model>>("v1/models?limit=1000", { signal }), []);
  const ready = (models.value?.items ?? []).filter((model) => model.state === "ready");
  return (
    <Field label="Model">
      {(id) => (
        <select id={id} value={narrowing.model ?? ""} onChange={({ currentTarget: { value } }) => narrow(() => ({ model: value || null }))}>
          <option value="">the collection's own</option>
          {ready.map((model) => (
            <option key={model.name} value={model.name}>
              {model.name}
            </option>
          ))}
        </select>
      )}
    </Field>
  );
}
