// Lists that come page by page, of which what may have changed is asked for again while they are looked at.

import { computed, signal } from "@preact/signals";
import { useEffect, useMemo } from "preact/hooks";
import { ask, queryText, type Problem } from "../api/client";
import type { Page } from "../api/types";
import { asProblem } from "./loading";

interface Part<Item> {
  /** What the page was asked for with; null is the beginning. */
  cursor: string | null;
  items: Item[];
}

const AGAIN_MILLISECONDS = 3000;

/** A list of the API, to which items are added at one of its ends. */
export class LiveList<Item extends { id: string }> {
  private readonly parts = signal<Part<Item>[]>([]);
  /** Where the next page begins; undefined before the first, null after the last. */
  private readonly next = signal<string | null | undefined>(undefined);
  private abort = ended();
  private asking: Promise<boolean> | null = null;
  private isRefreshing = false;
  readonly problem = signal<Problem | null>(null);
  readonly items = computed(() => this.parts.value.flatMap((part) => part.items));
  readonly isWhole = computed(() => this.next.value === null);
  /** Whether the first page is still awaited. */
  readonly isLoading = computed(() => this.next.value === undefined && this.problem.value === null);

  constructor(
    private readonly path: string,
    private readonly query: string,
    private readonly grows: "first" | "last",
  ) {}

  begin(): void {
    this.abort = new AbortController();
    this.asking = null;
    this.isRefreshing = false;
    if (this.next.value === undefined) void this.more();
  }

  end(): void {
    this.abort.abort();
  }

  /** Forget all and begin anew. */
  again = (): void => {
    this.end();
    this.parts.value = [];
    this.next.value = undefined;
    this.problem.value = null;
    this.begin();
  };

  /** Load the next page, if there is one; true if one came. */
  more = (): Promise<boolean> => {
    if (this.next.value === null || this.abort.signal.aborted) return Promise.resolve(false);
    this.asking ??= this.load(this.abort.signal);
    return this.asking;
  };

  /** Load what is left; false if that failed. */
  async all(): Promise<boolean> {
    while (!this.isWhole.value) {
      if (!(await this.more())) return this.isWhole.value;
    }
    return true;
  }

  /** Ask again for the pages that have such an item, and for the end at which the list grows. */
  async refresh(isStale: (item: Item, position: number) => boolean): Promise<void> {
    if (this.isRefreshing || this.next.value === undefined) return;
    const { signal } = this.abort;
    this.isRefreshing = true;
    try {
      for (const part of this.stale(isStale)) {
        const page = await this.ask(part.cursor, signal);
        if (!signal.aborted) this.take(part.cursor, page);
      }
    } catch (error) {
      if (!signal.aborted && !asProblem(error).isAway) this.problem.value = asProblem(error);
    } finally {
      if (!signal.aborted) this.isRefreshing = false;
    }
  }

  /** Change items that are there without asking; null takes one out. */
  change(change: (item: Item) => Item | null): void {
    this.parts.value = this.parts.value.map((part) => ({
      ...part,
      items: part.items.map(change).filter((item) => item !== null),
    }));
  }

  private async load(signal: AbortSignal): Promise<boolean> {
    const cursor = this.next.value ?? null;
    try {
      const page = await this.ask(cursor, signal);
      if (signal.aborted) return false;
      const known = new Set(this.items.value.map((item) => item.id));
      const items = page.items.filter((item) => !known.has(item.id));
      this.parts.value = [...this.parts.value, { cursor, items }];
      this.next.value = page.next_cursor;
      this.problem.value = null;
      return true;
    } catch (error) {
      if (!signal.aborted) this.fail(asProblem(error), signal);
      return false;
    } finally {
      if (!signal.aborted) this.asking = null;
    }
  }

  private ask(cursor: string | null, signal: AbortSignal): Promise<Page<Item>> {
    const from = cursor === null ? "" : `&cursor=${encodeURIComponent(cursor)}`;
    return ask<Page<Item>>(`${this.path}${this.query}${from}`, { signal });
  }

  private fail(problem: Problem, signal: AbortSignal): void {
    this.problem.value = problem;
    if (problem.isAway) window.setTimeout(() => !signal.aborted && void this.more(), AGAIN_MILLISECONDS);
  }

  private stale(isStale: (item: Item, position: number) => boolean): Part<Item>[] {
    const parts = this.parts.value;
    const end = this.grows === "first" ? 0 : parts.length - 1;
    let position = 0;
    return parts.filter(
      (part, index) => part.items.filter((item) => isStale(item, position++)).length > 0 || index === end,
    );
  }

  /** Put a page that was asked for again in the place of the one before. */
  private take(cursor: string | null, page: Page<Item>): void {
    const index = this.parts.value.findIndex((part) => part.cursor === cursor);
    const before = this.parts.value[index];
    if (before === undefined) return;
    const others = new Set(
      this.parts.value.flatMap((part) => (part === before ? [] : part.items.map((item) => item.id))),
    );
    const found = new Set(page.items.map((item) => item.id));
    const lastKept = before.items.findLastIndex((item) => found.has(item.id));
    if (lastKept < 0 && before.items.length > 0 && !page.items.some((item) => others.has(item.id))) {
      if (page.next_cursor !== null || this.grows === "first") return this.again(); // nothing of it is known any more
    }
    const isPushed = this.grows === "first" && page.next_cursor !== null;
    const pushedOut = isPushed ? before.items.slice(lastKept + 1) : [];
    const items = [...page.items.filter((item) => !others.has(item.id)), ...pushedOut];
    this.parts.value = this.parts.value.with(index, { cursor, items });
    if (index === this.parts.value.length - 1 && pushedOut.length === 0) this.next.value = page.next_cursor;
  }
}

function ended(): AbortController {
  const abort = new AbortController();
  abort.abort();
  return abort;
}

/** A list for as long as the component shows it; other parameters make another list. */
export function useLive<Item extends { id: string }>(
  path: string,
  parameters: Record<string, string | number | null | undefined>,
  limit: number,
  grows: "first" | "last",
): LiveList<Item> {
  const query = queryText({ ...parameters, limit });
  const list = useMemo(() => new LiveList<Item>(path, query, grows), [path, query, grows]);
  useEffect(() => {
    list.begin();
    return () => list.end();
  }, [list]);
  return list;
}
