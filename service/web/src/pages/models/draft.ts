// A model that is to be made: what the form holds, what is sent, and how much work it is.

import type { Collection, Json, NewModel } from "../../api/types";
import { count, grouped } from "../../ui/words";
import { parametersOf, type Values } from "./options";
import { PAPER, STRENGTHS } from "./transformations";
import { METHODS } from "./words";

export type Origin = "creatures" | "collection" | "both";

export interface Draft {
  name: string;
  method: string;
  origin: Origin;
  collection: string;
  /** Text of number fields; empty leaves the choice to the service. */
  creatures: string;
  shapes: string;
  seed: string;
  isOrdered: boolean;
  transformations: string[];
  strengths: number[];
  values: Values;
}

export const EMPTY: Draft = {
  name: "",
  method: "bank",
  origin: "creatures",
  collection: "",
  creatures: "",
  shapes: "",
  seed: "",
  isOrdered: false,
  transformations: [...PAPER],
  strengths: [...STRENGTHS],
  values: {},
};
/** Unless more are asked for; as the service has it. */
export const DEFAULT_COUNTS = { bankCreatures: 60, creatures: 12, shapes: 50 } as const;
const MOST_VARIANTS = 20_000;
const MOST_PAIRS = 5000;
const SECONDS = { bank: 0.6, kernel: 1.2 } as const; // of two processors, of a copy

export function learns(draft: Draft): boolean {
  return METHODS[draft.method]?.learns ?? false;
}

/** Whether it learns from a collection, and from creatures. A single kernel takes one of both. */
export function sources(draft: Draft): { collection: boolean; creatures: boolean } {
  const origin = draft.origin === "both" && draft.method !== "bank" ? "collection" : draft.origin;
  return { collection: origin !== "creatures", creatures: origin !== "collection" };
}

/** Whether shapes of one label are each other's copies, so that nothing is simulated. */
export function isOrdered(draft: Draft): boolean {
  return draft.isOrdered && draft.method !== "bank" && sources(draft).collection;
}

/** Whether there is something to learn from. */
export function isComplete(draft: Draft): boolean {
  if (!learns(draft)) return true;
  if (sources(draft).collection && !draft.collection) return false;
  return isOrdered(draft) || (draft.transformations.length > 0 && draft.strengths.length > 0);
}

export function bodyOf(draft: Draft): NewModel {
  const parameters = parametersOf(draft.method, draft.values);
  const body = { name: draft.name.trim(), method: draft.method, ...(Object.keys(parameters).length && { parameters }) };
  return learns(draft) ? { ...body, training: trainingOf(draft) } : body;
}

function trainingOf(draft: Draft): Record<string, Json> {
  const from = sources(draft);
  const number = (name: string, text: string) => (text.trim() ? { [name]: Number(text) } : {});
  const isBank = draft.method === "bank";
  const creatures = draft.creatures.trim() || (from.collection ? String(DEFAULT_COUNTS.bankCreatures) : "");
  return {
    ...(from.collection && { collection: draft.collection }),
    ...(isOrdered(draft)
      ? { correspondence: "vertex-order" }
      : { transformations: draft.transformations, strengths: draft.strengths }),
    ...(isBank && from.creatures && number("creatures", creatures)),
    ...(from.collection && number("shapes", draft.shapes)),
    ...(!isBank && from.creatures && number("shapes", draft.creatures)),
    ...number("seed", draft.seed),
  };
}

interface Estimate {
  text: string;
  isTooMuch: boolean;
}

/** How much is computed, in words. */
export function estimate(draft: Draft, collections: readonly Collection[]): Estimate | null {
  if (!learns(draft)) return null;
  const shapes = countShapes(draft, collections);
  if (isOrdered(draft)) {
    return { text: `About ${count(shapes, "pair")} of stored shapes. That is quick.`, isTooMuch: false };
  }
  const [ways, strengths] = [draft.transformations.length, draft.strengths.length];
  const copies = shapes * ways * strengths;
  if (copies === 0) {
    return { text: "Nothing to learn from yet: choose shapes, transformations and strengths.", isTooMuch: false };
  }
  const isBank = draft.method === "bank";
  const most = isBank ? MOST_VARIANTS : MOST_PAIRS;
  const seconds = copies * (isBank ? SECONDS.bank : SECONDS.kernel);
  const product = [count(shapes, "shape"), count(ways, "transformation"), count(strengths, "strength")].join(" × ");
  const isTooMuch = copies > most;
  const cost = isTooMuch
    ? `At most ${grouped(most)} can be learned from: take fewer.`
    : `On two processors ${minutes(seconds)}.`;
  return { text: `${product}: ${count(copies, "deformed copy", "deformed copies")}. ${cost}`, isTooMuch };
}

function countShapes(draft: Draft, collections: readonly Collection[]): number {
  const from = sources(draft);
  const ready = collections.find((one) => one.name === draft.collection)?.ready_count ?? 0;
  const usual = draft.method === "bank" ? DEFAULT_COUNTS.bankCreatures : DEFAULT_COUNTS.creatures;
  return (
    (from.collection ? Math.min(ready, Number(draft.shapes) || DEFAULT_COUNTS.shapes) : 0) +
    (from.creatures ? Number(draft.creatures) || usual : 0)
  );
}

function minutes(seconds: number): string {
  if (seconds < 90) return "a minute or so";
  if (seconds < 90 * 60) return `about ${Math.round(seconds / 60)} minutes`;
  return `about ${Math.round(seconds / 3600)} hours`;
}
