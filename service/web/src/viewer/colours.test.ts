import { describe, expect, it } from "vitest";
import { colourAt, rangeOf } from "./colours";

describe("the scale of colours", () => {
  it("gets lighter from low to high", () => {
    const light = Array.from({ length: 11 }, (_, i) => {
      const [red, green, blue] = colourAt(i / 10, "sequential");
      return 0.2126 * red + 0.7152 * green + 0.0722 * blue;
    });
    expect(light).toEqual([...light].sort((a, b) => a - b));
  });

  it("stays in its ends", () => {
    expect(colourAt(-3, "sequential")).toEqual(colourAt(0, "sequential"));
    expect(colourAt(7, "diverging")).toEqual(colourAt(1, "diverging"));
    expect(colourAt(Number.NaN, "diverging")).toEqual(colourAt(0, "diverging"));
  });
});

describe("the range of fields", () => {
  it("is one for all of them", () => {
    expect(rangeOf([Float32Array.of(1, 2), Float32Array.of(5)], "sequential")).toEqual({ low: 1, high: 5 });
  });

  it("has zero in the middle where signs count", () => {
    expect(rangeOf([Float32Array.of(-1, 3)], "diverging")).toEqual({ low: -3, high: 3 });
  });

  it("is never empty", () => {
    const { low, high } = rangeOf([Float32Array.of(2, 2)], "sequential");
    expect(high).toBeGreaterThan(low);
    expect(rangeOf([], "sequential")).toEqual({ low: 0, high: 1 });
  });

  it("does not follow single outliers", () => {
    const field = Float32Array.from({ length: 1000 }, (_, i) => (i === 0 ? 1e9 : i));
    expect(rangeOf([field], "sequential").high).toBeLessThan(1000);
  });
});
