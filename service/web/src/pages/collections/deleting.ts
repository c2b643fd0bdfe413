// Deleting with a way back: gone from the page at once, gone from the service a little later.

import { signal } from "@preact/signals";
import { Problem, send } from "../../api/client";
import type { Collection, Shape } from "../../api/types";
import { doLater, notifyProblem } from "../../ui/toasts";
import { count, fileName } from "../../ui/words";
import { each } from "./pool";

/** Ids of shapes and keys of collections that are not shown any more. */
export const hidden = signal<ReadonlySet<string>>(new Set());
/** How many deleted shapes of each collection the service still counts. */
export const stillCounted = signal<Readonly<Record<string, number>>>({});

const AT_ONCE = 4;
let isLeaving = false;
window.addEventListener("pagehide", () => (isLeaving = true), { capture: true });
window.addEventListener("pageshow", () => (isLeaving = false));

export function deleteShapes(collection: string, shapes: readonly Shape[], done: () => void): void {
  const ids = shapes.map(({ id }) => id);
  const [first] = shapes;
  if (first === undefined) return;
  hide(ids);
  counted(collection, ids.length);
  const put = (back: readonly string[]) => {
    show(back);
    counted(collection, -back.length);
  };
  const act = async () => {
    const kept = await deleteEach(
      ids,
      (id) => `v1/shapes/${id}`,
      () => counted(collection, -1),
    );
    put(kept);
    done();
  };
  const what = shapes.length === 1 ? fileName(first.name) : count(shapes.length, "shape");
  doLater(
    `${what} deleted`,
    () => void act(),
    () => put(ids),
  );
}

export function deleteCollection(collection: Collection): void {
  const { name } = collection;
  const keys = [keyOf(collection)];
  hide(keys);
  const act = async () => {
    const kept = await deleteEach(
      [name],
      (one) => `v1/collections/${one}`,
      () => {},
    );
    if (kept.length > 0) show(keys);
  };
  doLater(
    `${name} deleted, with its shapes`,
    () => void act(),
    () => show(keys),
  );
}

export function isHiddenCollection(collection: Collection): boolean {
  return hidden.value.has(keyOf(collection));
}

/** Another collection of the same name is another collection. */
function keyOf(collection: Collection): string {
  return `${collection.name} ${collection.created_at}`;
}

/** Delete each; those that could not be. What is gone already counts as deleted. */
async function deleteEach(
  names: readonly string[],
  path: (name: string) => string,
  one: () => void,
): Promise<string[]> {
  const kept: string[] = [];
  let reason: unknown = null;
  await each(names, isLeaving ? names.length : AT_ONCE, async (name) => {
    try {
      await send(path(name), { method: "DELETE" });
      one();
    } catch (error) {
      if (error instanceof Problem && error.status === 404) return one();
      kept.push(name);
      reason = error;
    }
  });
  if (kept.length > 0) notifyProblem(reason);
  return kept;
}

function hide(keys: readonly string[]): void {
  hidden.value = new Set([...hidden.value, ...keys]);
}

function show(keys: readonly string[]): void {
  const back = new Set(keys);
  hidden.value = new Set([...hidden.value].filter((key) => !back.has(key)));
}

function counted(collection: string, more: number): void {
  stillCounted.value = { ...stillCounted.value, [collection]: (stillCounted.value[collection] ?? 0) + more };
}
