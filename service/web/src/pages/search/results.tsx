// Ranked matches as cards, and what narrows them.

import { useState } from "preact/hooks";
import { ask } from "../../api/client";
import type { Match, Model, Page, QueryResult } from "../../api/types";
import { change, linkTo, route } from "../../router";
import { Empty, Field, Similarity, Thumbnail } from "../../ui/basics";
import { useLoad } from "../../ui/loading";
import { brief, count, fileName } from "../../ui/words";
import { MOST_MATCHES, type Narrowing } from "./asking";
import { DropZone } from "./start";

const FEW = 12;

interface Props {
  result: QueryResult;
  chosen: string | null;
  choose: (shape: string) => void;
  narrowing: Narrowing;
  narrow: (changed: Partial<Narrowing>) => void;
  send: (file: File) => void;
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
        <Narrow {...props} />
      </div>
      <p class="quiet" role="status">
        {count(shown.length, "match", "matches")} of {count(result.searched, "shape")} searched in{" "}
        {result.took_ms < 10 ? result.took_ms.toFixed(1) : Math.round(result.took_ms)} ms, by <a href={linkTo(["models", result.model])}>{result.model}</a>
      </p>
      {shown.length === 0 ? (
        <Empty title="Nothing passes the filters">
          <p>
            <button type="button" onClick={() => props.narrow({ label: null, transformation: null })}>
              Search without filters
            </button>
          </p>
        </Empty>
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

function Narrow(props: Props) {
  const { narrowing, narrow, result } = props;
  const models = useLoad((signal) => ask<Page<Model>>("v1/models?limit=1000", { signal }), []);
  const ready = (models.value?.items ?? []).filter((model) => model.state === "ready");
  const labels = unique(result.matches.map((match) => match.shape.label));
  const transformations = unique(result.matches.map((match) => match.shape.transformation));
  return (
    <>
      <TextFilter name="Label" value={narrowing.label} known={labels} set={(label) => narrow({ label })} />
      {(transformations.length > 0 || narrowing.transformation) && (
        <TextFilter
          name="Transformation"
          value={narrowing.transformation}
          known={transformations}
          set={(transformation) => narrow({ transformation })}
        />
      )}
      <Field label="Model">
        {(id) => (
          <select id={id} value={narrowing.model ?? ""} onChange={(event) => narrow({ model: event.currentTarget.value || null })}>
            <option value="">the collection's own</option>
            {ready.map((model) => (
              <option key={model.name} value={model.name}>
                {model.name}
              </option>
            ))}
          </select>
        )}
      </Field>
    </>
  );
}

function TextFilter(props: { name: string; value: string | null; known: string[]; set: (value: string | null) => void }) {
  const [text, setText] = useState(props.value ?? "");
  const commit = (value: string) => (value.trim() || null) !== props.value && props.set(value.trim() || null);
  return (
    <Field label={props.name}>
      {(id) => (
        <>
          <input
            id={id}
            type="search"
            value={text}
            placeholder="any"
            list={`${id}-known`}
            size={12}
            onInput={(event) => setText(event.currentTarget.value)}
            onChange={(event) => commit(event.currentTarget.value)}
          />
          <datalist id={`${id}-known`}>
            {props.known.map((one) => (
              <option key={one} value={one} />
            ))}
          </datalist>
        </>
      )}
    </Field>
  );
}

function unique(values: (string | null)[]): string[] {
  return [...new Set(values.filter((value): value is string => value !== null))].sort();
}
