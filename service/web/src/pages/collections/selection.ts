// Which shapes are selected: one by one, in ranges, or all.

import { useMemo, useRef, useState } from "preact/hooks";
import type { Shape } from "../../api/types";

export interface Selection {
  chosen: Shape[];
  isChosen: (id: string) => boolean;
  /** Select a shape or not; `toHere` does the same with all since the last one. */
  choose: (id: string, isChosen: boolean, toHere: boolean) => void;
  all: (whole: readonly Shape[]) => void;
  clear: () => void;
}

export function useSelection(shapes: readonly Shape[]): Selection {
  const [ids, setIds] = useState<ReadonlySet<string>>(new Set());
  const last = useRef<string | null>(null);
  const chosen = useMemo(() => (ids.size === 0 ? [] : shapes.filter(({ id }) => ids.has(id))), [shapes, ids]);
  const choose = (id: string, isChosen: boolean, toHere: boolean) => {
    const range = toHere ? between(shapes, last.current, id) : [id];
    last.current = id;
    setIds((before) => {
      const changed = new Set(before);
      for (const one of range) {
        if (isChosen) changed.add(one);
        else changed.delete(one);
      }
      return changed;
    });
  };
  return {
    chosen,
    isChosen: (id) => ids.has(id),
    choose,
    all: (whole) => setIds(new Set(whole.map(({ id }) => id))),
    clear: () => setIds(new Set()),
  };
}

/** Ids from one shape to another, whichever comes first; the other alone if the one is not there. */
function between(shapes: readonly Shape[], one: string | null, other: string): string[] {
  const places = [one, other].map((id) => shapes.findIndex((shape) => shape.id === id));
  if (places.includes(-1)) return [other];
  return shapes.slice(Math.min(...places), Math.max(...places) + 1).map(({ id }) => id);
}
