import { expect, test } from "vitest";
import { standOf } from "./steps";

const one = { done: 0, total: 1, unit: "meshes" };
const many = { done: 4, total: 5, unit: "shapes" };

test("a job of one mesh says what is done with it", () => {
  expect(standOf({ state: "queued", step: null, progress: one })).toBe("waiting for a worker");
  expect(standOf({ state: "running", step: "spectrum", progress: one })).toBe("computing its spectrum");
  expect(standOf({ state: "running", step: null, progress: one })).toBe("0 of 1 meshes");
});

test("a job of several says how many are done, and what is done with the last", () => {
  expect(standOf({ state: "running", step: null, progress: many })).toBe("4 of 5 shapes");
  expect(standOf({ state: "running", step: "learning", progress: many })).toBe("4 of 5 shapes, learning");
});

test("a step that the page does not know is named as it is", () => {
  expect(standOf({ state: "running", step: "polishing", progress: one })).toBe("polishing");
});
