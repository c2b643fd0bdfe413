// The reports of trainings, read from the model's JSON; a field that is missing is left out.

import type { JobError, Json, Model } from "../../api/types";

export interface Rows {
  map: Record<string, number>;
  mean: number;
  interval: [number, number] | null;
}

/** From what a model was learned. */
export interface Source {
  collection: string | null;
  transformations: string[];
  strengths: number[];
  correspondence: string;
  seed: number;
}

export interface BankReport {
  source: Source;
  references: number;
  copies: number;
  groups: number;
  candidates: number;
  heldOut: string[];
  rows: { training: Rows | null; heldOut: Rows | null };
  similarity: { promised: number; found: number }[];
  stages: [number, number][];
  failed: JobError[];
}

export interface KernelReport {
  source: Source;
  pairs: number;
  heldOutPairs: number;
  classes: string[];
  heldOut: string[];
  criterion: { training: Record<string, number>; heldOut: Record<string, number> | null };
  heatTime: number | null;
  slope: number | null;
  range: [number, number] | null;
  unit: string;
  failed: JobError[];
}

type Dict = Record<string, Json>;

export function bankReport(model: Model): BankReport | null {
  const report = model.training;
  if (report === null || !isDict(report.rows)) return null;
  return {
    source: sourceOf(report),
    references: numberOf(report.n_references) ?? 0,
    copies: numberOf(report.n_queries) ?? 0,
    groups: numberOf(report.n_groups) ?? 0,
    candidates: numberOf(report.n_candidates) ?? 0,
    heldOut: texts(report.held_out_groups),
    rows: { training: rowsOf(report.rows.training), heldOut: rowsOf(report.rows.held_out) },
    similarity: dicts(report.similarity).map((one) => ({
      promised: numberOf(one.promised) ?? 0,
      found: numberOf(one.found) ?? 0,
    })),
    stages: dicts(report.stages).map((one) => [numberOf(one.channels) ?? 0, numberOf(one.validation_loss) ?? 0]),
    failed: failures(report.failed_variants),
  };
}

export function kernelReport(model: Model): KernelReport | null {
  const report = model.training;
  if (report === null || !isDict(report.criterion) || !isDict(report.criterion.training)) return null;
  const heldOut = report.criterion["held-out"];
  return {
    source: sourceOf(report),
    pairs: numberOf(report.n_pairs) ?? 0,
    heldOutPairs: numberOf(report.n_held_out_pairs) ?? 0,
    classes: texts(report.classes),
    heldOut: texts(report.held_out_classes),
    criterion: { training: figures(report.criterion.training), heldOut: isDict(heldOut) ? figures(heldOut) : null },
    heatTime: numberOf(report.heat_time),
    slope: numberOf(report.slope),
    range: pairOf(report.trained_range),
    unit: typeof report.unit === "string" ? report.unit : "none",
    failed: failures(report.failed_pairs),
  };
}

/** What the mean of the rows loses without each channel, in points. */
export function ablationOf(model: Model): ReadonlyMap<string, number> {
  const entries = dicts(model.training?.ablation);
  return new Map(entries.map((one) => [String(one.channel), numberOf(one.lost) ?? 0]));
}

export function sourceOf(report: Dict): Source {
  return {
    collection: typeof report.collection === "string" ? report.collection : null,
    transformations: texts(report.transformations),
    strengths: (Array.isArray(report.strengths) ? report.strengths : []).map(Number),
    correspondence: String(report.correspondence ?? "simulated"),
    seed: numberOf(report.seed) ?? 0,
  };
}

function rowsOf(value: Json | undefined): Rows | null {
  if (!isDict(value) || !isDict(value.map)) return null;
  return { map: figures(value.map), mean: numberOf(value.mean) ?? 0, interval: pairOf(value.interval) };
}

function isDict(value: Json | undefined): value is Dict {
  return typeof value === "object" && value !== null && !Array.isArray(value);
}

function dicts(value: Json | undefined): Dict[] {
  return Array.isArray(value) ? value.filter(isDict) : [];
}

function texts(value: Json | undefined): string[] {
  return Array.isArray(value) ? value.map(String) : [];
}

function numberOf(value: Json | undefined): number | null {
  return typeof value === "number" ? value : null;
}

function pairOf(value: Json | undefined): [number, number] | null {
  if (!Array.isArray(value) || value.length !== 2) return null;
  const [low, high] = value.map(Number) as [number, number];
  return [low, high];
}

function figures(value: Dict): Record<string, number> {
  const known = Object.entries(value).filter((entry): entry is [string, number] => typeof entry[1] === "number");
  return Object.fromEntries(known);
}

function failures(value: Json | undefined): JobError[] {
  return dicts(value).map((one) => ({
    item: String(one.item ?? ""),
    type: String(one.type ?? ""),
    detail: String(one.detail ?? ""),
  }));
}
