// The shapes of a collection: filtered, chosen, relabelled, deleted.

import { useEffect, useMemo, useRef, useState } from "preact/hooks";
import type { Collection, Shape } from "../../api/types";
import { Empty, Trouble } from "../../ui/basics";
import { Grid } from "../../ui/grid";
import { useLive, type LiveList } from "../../ui/live";
import { useEvery } from "../../ui/loading";
import { count, grouped } from "../../ui/words";
import { ShapeCard } from "./card";
import { deleteShapes, hidden, stillCounted } from "./deleting";
import { AddButtons } from "./drop";
import type { Picked } from "./files";
import { chosenFilters, FilterRow, isFiltered, type Filters } from "./filters";
import { Relabelling } from "./relabel";
import { useSelection } from "./selection";

interface Props {
  collection: Collection;
  /** Whether nothing of it is waiting or being computed. */
  isSettled: boolean;
  changed: () => void;
  add: (picked: Picked) => void;
}

const PAGE = 200;
const CELL = { width: 168, height: 264 };
const MORE = 12; // cards to come, while it is not known how many
const LIVE_MILLISECONDS = 2000;

export function Shapes(props: Props) {
  const { collection, changed } = props;
  const filters = chosenFilters();
  const list = useLive<Shape>(`v1/collections/${collection.name}/shapes`, { ...filters }, PAGE, "last");
  const seen = useKeptUpToDate(list, collection, props.isSettled);
  const [isRelabelling, setRelabelling] = useState(false);
  const heading = useRef<HTMLHeadingElement>(null);
  const items = list.items.value;
  const gone = hidden.value;
  const shapes = useMemo(() => items.filter(({ id }) => !gone.has(id)), [items, gone]);
  const selection = useSelection(shapes);
  const total = totalOf(collection, filters, list, shapes);
  const remove = () => {
    deleteShapes(collection.name, selection.chosen, changed);
    selection.clear();
    heading.current?.focus();
  };
  const keys = (event: KeyboardEvent) => {
    const { target } = event;
    if (selection.chosen.length === 0 || !(target instanceof HTMLElement)) return;
    if (target.closest("dialog, form") !== null) return; // there these keys mean something else
    if (event.key === "Escape") selection.clear();
    if (event.key === "Delete") remove();
  };
  return (
    <section aria-label="Shapes" onKeyDown={keys}>
      <FilterRow filters={filters} shapes={items} />
      <header class="row shown">
        <h2 ref={heading} tabIndex={-1}>
          {list.isLoading.value ? "Loading…" : countText(total, list.isWhole.value || !isFiltered(filters))}
        </h2>
        {shapes.length > 0 && <SelectAll list={list} all={() => selection.all(list.items.peek())} />}
      </header>
      {selection.chosen.length > 0 && (
        <div class="chosenbar" role="group" aria-label="What is selected">
          <span role="status">{grouped(selection.chosen.length)} selected</span>
          <button type="button" onClick={() => setRelabelling(true)}>
            Relabel
          </button>
          <button type="button" class="danger" onClick={remove}>
            Delete
          </button>
          <button type="button" class="plain" onClick={selection.clear}>
            Clear
          </button>
        </div>
      )}
      <Trouble problem={list.problem.value} again={list.again} />
      {list.isWhole.value && shapes.length === 0 ? (
        <Nothing isFiltered={isFiltered(filters)} add={props.add} />
      ) : (
        <Grid
          items={shapes}
          total={total}
          keyOf={(shape) => shape.id}
          cell={CELL}
          label={`Shapes of ${collection.name}`}
          more={() => void list.more()}
          seen={seen}
        >
          {(shape) => (
            <ShapeCard
              shape={shape}
              isChosen={selection.isChosen(shape.id)}
              choose={(isChosen, toHere) => selection.choose(shape.id, isChosen, toHere)}
              queued={() =>
                list.change((other) => (other.id === shape.id ? { ...other, state: "queued", error: null } : other))
              }
              changed={changed}
            />
          )}
        </Grid>
      )}
      {isRelabelling && (
        <Relabelling
          shapes={selection.chosen}
          close={() => setRelabelling(false)}
          changed={(after) => list.change((shape) => (shape.id === after.id ? after : shape))}
          done={selection.clear}
        />
      )}
    </section>
  );
}

/** Ask again for visible shapes that are not settled, and for newer ones; returns the grid's callback. */
function useKeptUpToDate(list: LiveList<Shape>, collection: Collection, isSettled: boolean) {
  const range = useRef({ first: 0, last: 0 });
  const { shape_count, ready_count, failed_count } = collection;
  const refresh = (isChanged: boolean) => {
    const { first, last } = range.current;
    void list.refresh(({ state }, position) => {
      const isOpen = state === "queued" || state === "processing";
      return position >= first && position < last && (isChanged || isOpen);
    });
  };
  useEffect(() => refresh(true), [list, shape_count, ready_count, failed_count]);
  const soon = useMemo(() => () => refresh(false), [list]);
  useEvery(isSettled ? null : LIVE_MILLISECONDS, soon);
  return (first: number, last: number) => {
    range.current = { first, last };
  };
}

function totalOf(collection: Collection, filters: Filters, list: LiveList<Shape>, shapes: readonly Shape[]): number {
  if (list.isWhole.value) return shapes.length;
  if (isFiltered(filters)) return shapes.length + MORE;
  return Math.max(shapes.length, collection.shape_count - (stillCounted.value[collection.name] ?? 0));
}

function countText(total: number, isKnown: boolean): string {
  return isKnown ? count(total, "shape") : `${grouped(total - MORE)} shapes and more`;
}

function SelectAll(props: { list: LiveList<Shape>; all: () => void }) {
  const [isBusy, setBusy] = useState(false);
  const select = async () => {
    setBusy(true);
    if (await props.list.all()) props.all();
    setBusy(false);
  };
  return (
    <button type="button" class="small" disabled={isBusy} onClick={() => void select()}>
      {isBusy ? "Loading them all…" : "Select all shown"}
    </button>
  );
}

function Nothing(props: { isFiltered: boolean; add: (picked: Picked) => void }) {
  if (props.isFiltered) {
    return (
      <Empty title="No shape is like that">
        <p>Label, transformation and name have to be met exactly, folders from the first on.</p>
      </Empty>
    );
  }
  return (
    <Empty title="It has no shapes yet">
      <p>
        Drop meshes, folders or archives anywhere on this page, or choose them. A folder's name becomes the label.
      </p>
      <p class="row middle">
        <AddButtons take={props.add} />
      </p>
    </Empty>
  );
}
