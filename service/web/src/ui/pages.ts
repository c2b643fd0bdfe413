// Lists that come page by page: as many as have been looked at.

import { useCallback, useEffect, useRef, useState } from "preact/hooks";
import { ask, queryText, type Problem } from "../api/client";
import type { Page } from "../api/types";
import { asProblem } from "./loading";

export interface Paged<Item> {
  items: Item[];
  /** Whether the last page is there. */
  isWhole: boolean;
  isLoading: boolean;
  problem: Problem | null;
  more: () => void;
  /** Begin anew. */
  again: () => void;
  /** Change what is shown without asking. */
  set: (change: (items: Item[]) => Item[]) => void;
}

/** A list of the API; `null` as path loads nothing. */
export function usePaged<Item>(
  path: string | null,
  parameters: Record<string, string | number | null | undefined>,
  limit = 100,
): Paged<Item> {
  const query = queryText({ ...parameters, limit });
  const [items, set] = useState<Item[]>([]);
  const [problem, setProblem] = useState<Problem | null>(null);
  const [isWhole, setWhole] = useState(false);
  const [isLoading, setLoading] = useState(path !== null);
  const [turn, setTurn] = useState(0);
  const cursor = useRef<string | null>(null);
  const busy = useRef<AbortController | null>(null);

  const load = useCallback(
    (begin: boolean) => {
      if (path === null) return;
      if (begin) busy.current?.abort();
      else if (busy.current) return;
      const abort = new AbortController();
      busy.current = abort;
      setLoading(true);
      const next = begin ? null : cursor.current;
      ask<Page<Item>>(`${path}${query}${next ? `&cursor=${encodeURIComponent(next)}` : ""}`, { signal: abort.signal })
        .then((page) => {
          cursor.current = page.next_cursor;
          set((before) => (begin ? page.items : [...before, ...page.items]));
          setWhole(page.next_cursor === null);
          setProblem(null);
        })
        .catch((error: unknown) => {
          if (!abort.signal.aborted) setProblem(asProblem(error));
        })
        .finally(() => {
          if (busy.current !== abort) return;
          busy.current = null;
          setLoading(false);
        });
    },
    [path, query],
  );

  useEffect(() => {
    load(true);
    return () => {
      busy.current?.abort();
      busy.current = null;
    };
  }, [load, turn]);

  const more = useCallback(() => {
    if (cursor.current !== null) load(false);
  }, [load]);
  const again = useCallback(() => setTurn((before) => before + 1), []);
  return { items, isWhole, isLoading, problem, more, again, set };
}
