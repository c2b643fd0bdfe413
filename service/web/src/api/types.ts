// What the service answers, field by field as its OpenAPI document says.

export type State = "queued" | "running" | "succeeded" | "failed" | "cancelled";
export type ShapeState = "queued" | "processing" | "ready" | "failed";
export type JobKind = "ingest" | "query" | "train" | "describe" | "evaluate";
export type Json = string | number | boolean | null | Json[] | { [key: string]: Json };

export interface Page<Item> {
  items: Item[];
  next_cursor: string | null;
}

export interface Collection {
  name: string;
  description: string;
  model: string;
  shape_count: number;
  ready_count: number;
  failed_count: number;
  created_at: string;
}

export interface Shape {
  id: string;
  collection: string;
  name: string;
  label: string | null;
  transformation: string | null;
  strength: number | null;
  metadata: Record<string, Json>;
  sha256: string;
  format: string | null;
  n_vertices: number | null;
  n_faces: number | null;
  area: number | null;
  n_components: number | null;
  n_boundary_loops: number | null;
  repairs: string[];
  state: ShapeState;
  error: { type: string; detail: string } | null;
  created_at: string;
}

export interface JobError {
  item: string;
  type: string;
  detail: string;
}

export interface Job {
  id: string;
  kind: JobKind;
  state: State;
  progress: { done: number; total: number; unit: string };
  errors: JobError[];
  attempts: number;
  collection: string | null;
  model: string | null;
  created_at: string;
  started_at: string | null;
  finished_at: string | null;
}

export interface Condition {
  field: string;
  equals?: Json;
  in?: Json[];
  range?: { gt?: Json; gte?: Json; lt?: Json; lte?: Json };
}

export interface Filter {
  must?: Condition[];
  must_not?: Condition[];
  should?: Condition[];
}

export interface QueryOptions {
  limit?: number;
  model?: string;
  dissimilarity?: string;
  max_distance?: number;
  filter?: Filter;
  include_self?: boolean;
}

export interface Match {
  rank: number;
  distance: number;
  similarity: number;
  shape: Shape;
}

export interface QueryResult {
  collection: string;
  model: string;
  dissimilarity: string;
  query: { shape_id?: string | null; sha256?: string | null };
  matches: Match[];
  searched: number;
  took_ms: number;
}

export interface Kernel {
  kind: string;
  parameters: Record<string, Json>;
}

export interface Channel {
  name: string;
  view: string;
  kernel: Kernel | null;
  feature: string;
  normalisation: string;
  edges: number[] | null;
  levels: number[] | null;
  dissimilarity: string;
  scale: number;
  weight: number;
}

export interface KernelCurve {
  name: string;
  kind: string;
  eigenvalues: number[];
  squared_transfer: number[];
  parameters: Record<string, Json>;
}

export interface Model {
  name: string;
  method: string;
  state: "training" | "ready" | "failed";
  parameters: Record<string, Json>;
  channels: Channel[];
  views: { name: string; steps: { name: string; parameters: Record<string, number> }[]; eigenpairs: number }[];
  fusion: { power: number };
  versions: Record<string, string>;
  kernels: KernelCurve[];
  training: Record<string, Json> | null;
  created_at: string;
}

export interface Axis {
  kind: "edges" | "levels" | "index" | "times";
  values: number[];
}

/** One channel of a comparison: what it saw of both, and its part of their distance. */
export interface ComparedChannel extends Omit<Channel, "edges" | "levels"> {
  distance: number;
  share: number;
  axis: Axis;
  values: number[];
  asked_values: number[];
}

export interface Comparison {
  shape_id: string;
  asked_with: { shape_id?: string | null; query_id?: string | null };
  model: string;
  distance: number;
  similarity: number;
  fusion: { power: number };
  channels: ComparedChannel[];
}

export interface Spectrum {
  eigenvalues: number[];
  area: number;
  unit: string;
}

export interface Interval {
  value: number;
  low: number | null;
  high: number | null;
}

export interface Measures {
  nearest_neighbour: number;
  first_tier: number;
  second_tier: number;
  e_measure: number;
  dcg: number;
  map: number;
}

export type ByModel = Record<string, number>;

export interface Evaluation {
  id: string;
  job_id: string;
  collection: string;
  models: string[];
  dissimilarity: string | null;
  state: State;
  n_queries: number | null;
  n_targets: number | null;
  leave_one_out: boolean | null;
  mean_average_precision: ByModel;
  table: Record<string, ByModel>;
  by_strength: Record<string, Record<string, ByModel>>;
  by_label: Record<string, Record<string, Measures>>;
  measures: Record<string, Measures>;
  precision_recall: Record<string, [number, number][]>;
  mean_of_rows: Record<string, Interval>;
  mean_intervals: Record<string, Interval>;
  differences: Record<string, { mean_of_rows: Interval | null; mean_average_precision: Interval }>;
  skipped: { reason: string; count: number; shapes: { id: string; name: string }[] }[];
  ranks: { query: string; model: string; rank: number; top: string[] }[];
  created_at: string;
}

export interface NewModel {
  name: string;
  method: string;
  parameters?: Record<string, Json>;
  training?: Record<string, Json>;
}
