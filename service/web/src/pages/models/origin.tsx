// From what a model learns: a collection, the built-in creatures, or both.

import type { ComponentChildren } from "preact";
import type { Collection } from "../../api/types";
import { linkTo } from "../../router";
import { Field } from "../../ui/basics";
import { count } from "../../ui/words";
import { DEFAULT_COUNTS, isOrdered, sources, type Draft, type Origin } from "./draft";

interface Props {
  draft: Draft;
  set: (change: Partial<Draft>) => void;
  /** Null while they are loaded. */
  collections: readonly Collection[] | null;
}

const ORIGINS: [Origin, string][] = [
  ["creatures", "The built-in creatures"],
  ["collection", "Shapes of a collection"],
  ["both", "Both"],
];

export function OriginChoice(props: Props) {
  const { draft, set } = props;
  const from = sources(draft);
  const isBank = draft.method === "bank";
  const origins = ORIGINS.filter(([origin]) => origin !== "both" || isBank);
  const origin = origins.some(([one]) => one === draft.origin) ? draft.origin : "collection";
  return (
    <fieldset>
      <legend>What to learn from</legend>
      <div class="row">
        {origins.map(([one, name]) => (
          <label key={one} class="tick">
            <input type="radio" name="origin" checked={origin === one} onChange={() => set({ origin: one })} />
            {name}
          </label>
        ))}
      </div>
      <div class="parameters">
        {from.collection && <CollectionFields {...props} />}
        {from.creatures && (
          <CountField
            label="Creatures"
            hint="Animals and things that the program makes itself, of many species."
            value={draft.creatures}
            usual={isBank ? DEFAULT_COUNTS.bankCreatures : DEFAULT_COUNTS.creatures}
            change={(creatures) => set({ creatures })}
          />
        )}
      </div>
      {from.collection && !isBank && (
        <label class="tick">
          <input
            type="checkbox"
            checked={isOrdered(draft)}
            onChange={(event) => set({ isOrdered: event.currentTarget.checked })}
          />
          Its shapes of one label are poses with the same order of vertices: learn from these instead of deforming them
        </label>
      )}
    </fieldset>
  );
}

function CollectionFields(props: Props) {
  const { draft, set, collections } = props;
  if (collections === null) return <p class="loading">Loading…</p>;
  if (collections.length === 0) {
    return (
      <p>
        There is no collection yet. <a href={linkTo(["collections"])}>Make one</a>
      </p>
    );
  }
  return (
    <>
      <Field label="Collection" hint="A single kernel needs shapes of at least two labels.">
        {(id) => (
          <select
            id={id}
            required
            value={draft.collection}
            onChange={(event) => set({ collection: event.currentTarget.value })}
          >
            {!collections.some((one) => one.name === draft.collection) && <option value="">choose one</option>}
            {collections.map((one) => (
              <option key={one.name} value={one.name}>
                {one.name} · {count(one.ready_count, "shape")}
              </option>
            ))}
          </select>
        )}
      </Field>
      <CountField
        label="Shapes of it at most"
        hint="Spread evenly over the labels."
        value={draft.shapes}
        usual={DEFAULT_COUNTS.shapes}
        change={(shapes) => set({ shapes })}
      />
    </>
  );
}

interface CountProps {
  label: string;
  hint: ComponentChildren;
  value: string;
  usual: number;
  change: (value: string) => void;
}

function CountField(props: CountProps) {
  return (
    <Field label={props.label} hint={props.hint}>
      {(id) => (
        <input
          id={id}
          type="number"
          min={2}
          max={1000}
          step={1}
          placeholder={String(props.usual)}
          value={props.value}
          onInput={(event) => props.change(event.currentTarget.value)}
        />
      )}
    </Field>
  );
}
