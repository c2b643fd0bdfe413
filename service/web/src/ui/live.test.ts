import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import { LiveList } from "./live";

interface Item {
  id: string;
  state?: string;
}

/** A list of a service, newest first, page by page; the cursor is the id of the last item given. */
const served = vi.hoisted(() => ({ items: [] as { id: string; state?: string }[], asked: 0, isAway: false }));
const SIZE = 3;

vi.mock("../api/client", () => {
  class Problem extends Error {
    constructor(readonly status: number) {
      super("away");
    }
    get isAway() {
      return this.status === 0;
    }
  }
  return {
    Problem,
    serviceAnswers: { value: true },
    queryText: () => "?limit=3",
    ask: async (path: string) => {
      served.asked++;
      if (served.isAway) throw new Problem(0);
      const after = /cursor=(\w+)/.exec(path)?.[1];
      const from = after === undefined ? 0 : served.items.findIndex((item) => item.id < after);
      const items = from < 0 ? [] : served.items.slice(from, from + SIZE);
      const isLast = from < 0 || from + SIZE >= served.items.length;
      return { items, next_cursor: isLast ? null : items.at(-1)!.id };
    },
  };
});

function begun(): LiveList<Item> {
  const list = new LiveList<Item>("v1/jobs", "?limit=3", "first");
  list.begin();
  return list;
}

const ids = (list: LiveList<Item>) => list.items.value.map((item) => item.id);

describe("a list of which the newest come first", () => {
  beforeEach(() => {
    served.items = ["g", "f", "e", "d", "c", "b", "a"].map((id) => ({ id, state: "ended" }));
    served.asked = 0;
    served.isAway = false;
    vi.useFakeTimers();
    vi.stubGlobal("window", globalThis);
  });
  afterEach(() => {
    vi.useRealTimers();
    vi.unstubAllGlobals();
  });

  it("comes page by page until it is whole", async () => {
    const list = begun();
    expect(list.isLoading.value).toBe(true);
    await list.more();
    expect(ids(list)).toEqual(["g", "f", "e"]);
    expect(await list.all()).toBe(true);
    expect(ids(list)).toEqual(["g", "f", "e", "d", "c", "b", "a"]);
    expect(list.isWhole.value).toBe(true);
    expect(await list.more()).toBe(false);
  });

  it("asks once where it is asked twice at a time", async () => {
    const list = begun();
    await Promise.all([list.more(), list.more()]);
    expect(served.asked).toBe(1);
  });

  it("takes in what is new, and loses nothing that was pushed off the first page", async () => {
    const list = begun();
    await list.all();
    served.items.unshift({ id: "h", state: "running" });
    await list.refresh(() => false);
    expect(ids(list)).toEqual(["h", "g", "f", "e", "d", "c", "b", "a"]);
  });

  it("asks again only for pages that have something that may change", async () => {
    served.items[4]!.state = "running";
    const list = begun();
    await list.all();
    served.items[4] = { id: "c", state: "ended" };
    served.asked = 0;
    await list.refresh((item) => item.state === "running");
    expect(served.asked).toBe(2); // that page, and the end at which the list grows
    expect(list.items.value[4]!.state).toBe("ended");
  });

  it("begins anew where nothing of a page is known any more", async () => {
    const list = begun();
    await list.all();
    served.items = ["z", "y", "x", "w"].map((id) => ({ id }));
    await list.refresh(() => false);
    await list.all();
    expect(ids(list)).toEqual(["z", "y", "x", "w"]);
  });

  it("changes and takes out without asking", async () => {
    const list = begun();
    await list.more();
    served.asked = 0;
    list.change((item) => (item.id === "f" ? null : { ...item, state: "changed" }));
    expect(list.items.value).toEqual([
      { id: "g", state: "changed" },
      { id: "e", state: "changed" },
    ]);
    expect(served.asked).toBe(0);
  });

  it("goes on by itself when a service that was away is back", async () => {
    served.isAway = true;
    const list = begun();
    await list.more();
    expect(list.problem.value).not.toBeNull();
    served.isAway = false;
    await vi.advanceTimersByTimeAsync(3000);
    expect(list.problem.value).toBeNull();
    expect(ids(list)).toEqual(["g", "f", "e"]);
  });

  it("takes nothing in after its end", async () => {
    const list = begun();
    const asked = list.more();
    list.end();
    expect(await asked).toBe(false);
    expect(ids(list)).toEqual([]);
  });
});
