// Which shapes of a collection are shown; the choice stands in the address.

import { change, route } from "../../router";
import type { Shape } from "../../api/types";
import { Field } from "../../ui/basics";
import { foldersOf } from "../../ui/words";

export interface Filters {
  label: string | null;
  state: string | null;
  transformation: string | null;
  name: string | null;
  /** A folder, with all that is below it; or a whole path. */
  path: string | null;
}

const NONE: Filters = { label: null, state: null, transformation: null, name: null, path: null };

const STATES: [state: string, name: string][] = [
  ["ready", "ready"],
  ["queued", "waiting"],
  ["processing", "being computed"],
  ["failed", "failed"],
];

export function chosenFilters(): Filters {
  const { query } = route.value;
  return {
    label: query.get("label"),
    state: query.get("state"),
    transformation: query.get("transformation"),
    name: query.get("name"),
    path: query.get("path"),
  };
}

export function isFiltered(filters: Filters): boolean {
  return Object.values(filters).some(Boolean);
}

export function FilterRow(props: { filters: Filters; shapes: readonly Shape[] }) {
  const { filters, shapes } = props;
  return (
    <form
      class="row filters"
      role="search"
      aria-label="Which shapes are shown"
      onSubmit={(event) => event.preventDefault()}
    >
      <Exact name="label" title="Label" value={filters.label} known={shapes.map((shape) => shape.label)} />
      <Field label="State">
        {(id) => (
          <select
            id={id}
            value={filters.state ?? ""}
            onChange={(event) => change({ state: event.currentTarget.value })}
          >
            <option value="">any</option>
            {STATES.map(([state, name]) => (
              <option key={state} value={state}>
                {name}
              </option>
            ))}
          </select>
        )}
      </Field>
      <Exact
        name="transformation"
        title="Transformation"
        value={filters.transformation}
        known={shapes.map((shape) => shape.transformation)}
      />
      <Exact name="name" title="Name" value={filters.name} known={[]} hint="the whole name" />
      <Exact
        name="path"
        title="Folder"
        value={filters.path}
        known={shapes.flatMap((shape) => foldersOf(shape.path))}
        longest={1024}
      />
      {isFiltered(filters) && (
        <button type="button" onClick={() => change({ ...NONE })}>
          Show all
        </button>
      )}
    </form>
  );
}

/** A text that has to be met exactly; what is known is proposed. */
function Exact(props: {
  name: keyof Filters;
  title: string;
  value: string | null;
  known: (string | null)[];
  hint?: string;
  longest?: number;
}) {
  const known = [...new Set(props.known)].filter((text) => text !== null && text !== "").sort();
  return (
    <Field label={props.title}>
      {(id) => (
        <>
          <input
            id={id}
            type="search"
            autocomplete="off"
            placeholder={props.hint ?? "any"}
            list={`${id}-known`}
            maxLength={props.longest ?? 255}
            value={props.value ?? ""}
            onChange={(event) => change({ [props.name]: event.currentTarget.value })}
          />
          <datalist id={`${id}-known`}>
            {known.slice(0, 200).map((text) => (
              <option key={text} value={text ?? ""} />
            ))}
          </datalist>
        </>
      )}
    </Field>
  );
}
