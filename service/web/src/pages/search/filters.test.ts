import { describe, expect, it } from "vitest";
import { filterOf, testsOf, textOf, type Test } from "./filters";

const CAT: Test = { field: "label", how: "is", value: "cat" };
const DOG: Test = { field: "label", how: "is", value: "dog" };

describe("filters in the address", () => {
  it("come back as they went", () => {
    const tests: Test[] = [CAT, { field: "metadata.artist.name", how: "is not", value: 'a "b", c' }];
    expect(testsOf(textOf(tests))).toEqual(tests);
    expect(textOf([])).toBeNull();
    expect(testsOf(null)).toEqual([]);
  });

  it("are left out where they are none", () => {
    for (const text of ["{", "7", "null", '[["label","is"]]', '[["label","like","cat"]]', '[["area","is","1"]]', '[["label",1,"cat"]]']) {
      expect(testsOf(text)).toEqual([]);
    }
  });
});

describe("filters for the service", () => {
  it("say nothing without a test", () => {
    expect(filterOf([])).toBeNull();
  });

  it("take values of one field as alternatives, and fields together", () => {
    expect(filterOf([CAT, { field: "transformation", how: "is", value: "noise" }, DOG])).toEqual({
      must: [
        { field: "label", in: ["cat", "dog"] },
        { field: "transformation", in: ["noise"] },
      ],
    });
  });

  it("leave out and bound", () => {
    expect(
      filterOf([
        { ...CAT, how: "is not" },
        { field: "strength", how: "at most", value: "3" },
        { field: "metadata.year", how: "at least", value: "2024" },
      ]),
    ).toEqual({
      must: [
        { field: "strength", range: { lte: 3 } },
        { field: "metadata.year", range: { gte: 2024 } },
      ],
      must_not: [{ field: "label", in: ["cat"] }],
    });
  });

  it("know numbers from texts by their field", () => {
    expect(filterOf([{ field: "strength", how: "is", value: "3" }])).toEqual({ must: [{ field: "strength", in: [3] }] });
    expect(filterOf([{ field: "label", how: "is", value: "3" }])).toEqual({ must: [{ field: "label", in: ["3"] }] });
    expect(filterOf([{ field: "metadata.year", how: "is", value: "3" }])).toEqual({
      must: [{ field: "metadata.year", in: ["3", 3] }],
    });
  });

  it("take folders as alternatives, together with whole paths", () => {
    const inCats: Test = { field: "path", how: "under", value: "animals/cats" };
    expect(filterOf([inCats])).toEqual({ must: [{ field: "path", under: "animals/cats" }] });
    expect(
      filterOf([CAT, inCats, { ...inCats, value: "dogs" }, { field: "path", how: "is", value: "fish/1.off" }]),
    ).toEqual({
      must: [{ field: "label", in: ["cat"] }],
      should: [
        { field: "path", under: "animals/cats" },
        { field: "path", under: "dogs" },
        { field: "path", in: ["fish/1.off"] },
      ],
    });
    expect(filterOf([{ ...inCats, how: "not under" }])).toEqual({
      must_not: [{ field: "path", under: "animals/cats" }],
    });
  });

  it("test folders of paths alone", () => {
    expect(testsOf('[["label","under","cat"]]')).toEqual([]);
    expect(testsOf('[["path","at least","cat"]]')).toEqual([]);
    expect(testsOf('[["path","under","cat"]]')).toHaveLength(1);
  });
});
