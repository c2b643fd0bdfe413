import { expect, test } from "vitest";
import { standOf } from "./steps";

const one = { done: 0, total: 1, unit: "meshes" };
const many = { done: 4, total: 5, unit: "shapes" };

test("a job of one mesh says what is done with it", () => {
  expect(standOf({ state: "queued", step: null, seconds_left: null, progress: one })).toBe("waiting for a worker");
  expect(standOf({ state: "running", step: "spectrum", seconds_left: null, progress: one })).toBe("computing its spectrum");
  expect(standOf({ state: "running", step: null, seconds_left: null, progress: one })).toBe("0 of 1 meshes");
});

test("a job of several says how many are done, and what is done with the last", () => {
  expect(standOf({ state: "running", step: null, seconds_left: null, progress: many })).toBe("4 of 5 shapes");
  expect(standOf({ state: "running", step: "learning", seconds_left: null, progress: many })).toBe("4 of 5 shapes, learning");
});

test("how long it still takes is told where it is known", () => {
  expect(standOf({ state: "running", step: null, seconds_left: 170, progress: many })).toBe(
    "4 of 5 shapes, about 3 min left",
  );
});

test("a step that the page does not know is named as it is", () => {
  expect(standOf({ state: "running", step: "polishing", seconds_left: null, progress: one })).toBe("polishing");
});
