// The row of filters: those that are set, and a form for one more.

import { useState } from "preact/hooks";
import type { Shape } from "../../api/types";
import { Field } from "../../ui/basics";
import { foldersOf } from "../../ui/words";
import { howsOf, isField, type How, type Test } from "./filters";

const FIELDS = ["label", "name", "path", "transformation", "strength"] as const;
const OTHER = "metadata";

interface Props {
  tests: readonly Test[];
  shapes: readonly Shape[];
  /** From the current tests, which may be newer than those drawn. */
  set: (changed: (now: readonly Test[]) => Test[]) => void;
}

export function FilterRow(props: Props) {
  const { tests, set } = props;
  return (
    <div class="narrowing" role="group" aria-label="Filters">
      {tests.map((test, place) => (
        <button
          key={`${place} ${test.value}`}
          type="button"
          class="chip"
          aria-label={`Search without the filter ${wordsOf(test)}`}
          onClick={() => set((now) => now.filter((other) => wordsOf(other) !== wordsOf(test)))}
        >
          {wordsOf(test)} <span aria-hidden="true">✕</span>
        </button>
      ))}
      <OneMore {...props} />
    </div>
  );
}

function OneMore({ shapes, set }: Props) {
  const [field, setField] = useState<string>("label");
  const [key, setKey] = useState("");
  const [how, setHow] = useState<How>("is");
  const [value, setValue] = useState("");
  const named = field === OTHER ? `${OTHER}.${key.trim()}` : field;
  const isWhole = value.trim() !== "" && isField(named);
  const choose = (other: string) => {
    setField(other);
    if (other === "path" || !howsOf(other).includes(how)) setHow(howsOf(other)[0]!);
  };
  const add = (event: Event) => {
    event.preventDefault();
    if (!isWhole) return;
    const test = { field: named, how, value: value.trim() };
    set((now) => [...now, test]);
    setValue("");
  };
  return (
    <form class="onemore" onSubmit={add}>
      <Field label="Filter by">
        {(id) => (
          <select id={id} value={field} onChange={(event) => choose(event.currentTarget.value)}>
            {[...FIELDS, OTHER].map((name) => (
              <option key={name}>{name}</option>
            ))}
          </select>
        )}
      </Field>
      {field === OTHER && (
        <Field label="Key">
          {(id) => <input id={id} value={key} size={8} placeholder="year" onInput={(event) => setKey(event.currentTarget.value)} />}
        </Field>
      )}
      <Field label="How">
        {(id) => (
          <select id={id} value={how} onChange={(event) => setHow(event.currentTarget.value as How)}>
            {howsOf(field).map((name) => (
              <option key={name}>{name}</option>
            ))}
          </select>
        )}
      </Field>
      <Field label="Value">
        {(id) => (
          <>
            <input
              id={id}
              value={value}
              size={10}
              maxLength={255}
              autocomplete="off"
              list={`${id}-known`}
              onInput={(event) => setValue(event.currentTarget.value)}
            />
            <datalist id={`${id}-known`}>
              {known(shapes, field, how).map((one) => (
                <option key={one} value={one} />
              ))}
            </datalist>
          </>
        )}
      </Field>
      <button type="submit" disabled={!isWhole}>
        Add
      </button>
    </form>
  );
}

function wordsOf({ field, how, value }: Test): string {
  return `${field} ${how} ${value}`;
}

/** Values that the shapes shown have there. */
function known(shapes: readonly Shape[], field: string, how: How): string[] {
  if (!(FIELDS as readonly string[]).includes(field)) return [];
  if (how.endsWith("under")) return [...new Set(shapes.flatMap((shape) => foldersOf(shape.path)))].sort();
  const values = shapes.map((shape) => shape[field as (typeof FIELDS)[number]]);
  return [...new Set(values.filter((value) => value !== null).map(String))].sort();
}
