// Which shapes are selected: one by one, in ranges, or all.

import { useMemo, useRef, useState } from "preact/hooks";
import type { Shape } from "../../api/types";

export interface Selection {
  chosen: Shape[];
  isChosen: (id: string) => boolean;
  /** Select the shape at a position or not; `toHere` does the same with all since the last one. */
  choose: (position: number, isChosen: boolean, toHere: boolean) => void;
  all: (whole: readonly Shape[]) => void;
  clear: () => void;
}

export function useSelection(shapes: readonly Shape[]): Selection {
  const [ids, setIds] = useState<ReadonlySet<string>>(new Set());
  const last = useRef<string | null>(null);
  const chosen = useMemo(() => (ids.size === 0 ? [] : shapes.filter(({ id }) => ids.has(id))), [shapes, ids]);
  const choose = (position: number, isChosen: boolean, toHere: boolean) => {
    const from = toHere ? shapes.findIndex(({ id }) => id === last.current) : -1;
    const range = from < 0 ? [position, position] : [Math.min(from, position), Math.max(from, position)];
    const changed = new Set(ids);
    for (const { id } of shapes.slice(range[0], range[1]! + 1)) {
      if (isChosen) changed.add(id);
      else changed.delete(id);
    }
    last.current = shapes[position]?.id ?? null;
    setIds(changed);
  };
  return {
    chosen,
    isChosen: (id) => ids.has(id),
    choose,
    all: (whole) => setIds(new Set(whole.map(({ id }) => id))),
    clear: () => setIds(new Set()),
  };
}
