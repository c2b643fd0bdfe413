// What the service takes and answers: names for the page of types that are generated from its
// OpenAPI document (`python -m service.web --types` writes schema.ts).

import type { components } from "./schema";

type Schemas = components["schemas"];

/** What a JSON object may hold under a name. */
export type Json = string | number | boolean | null | Json[] | { [key: string]: Json };
/** An answer: every field is there, and what the document leaves open is JSON. */
type Answer<Name extends keyof Schemas> = Whole<Schemas[Name]>;
type Whole<T> = unknown extends T
  ? Json
  : T extends (infer Item)[]
    ? Whole<Item>[]
    : T extends object
      ? { [Key in keyof T]-?: Whole<Exclude<T[Key], undefined>> }
      : T;

export interface Page<Item> {
  items: Item[];
  next_cursor: string | null;
}

export type Collection = Answer<"CollectionAnswer">;
export type Shape = Answer<"ShapeAnswer">;
export type ShapeState = Shape["state"];

export type Job = Answer<"JobAnswer">;
export type JobError = Answer<"JobError">;
export type JobKind = Job["kind"];
export type State = Job["state"];

export type Condition = Schemas["Condition"];
export type Filter = Schemas["Filter"];
export type QueryOptions = Partial<Omit<Schemas["ShapeQuery"], "shape_id">>;
export type Match = Answer<"Match">;
export type QueryResult = Answer<"QueryResult">;

export type Model = Answer<"ModelAnswer">;
export type Channel = Answer<"ChannelAnswer">;
export type KernelCurve = Answer<"KernelAnswer">;
export type Axis = Answer<"DistributionAxis">;
/** One channel of a comparison: what it saw of both, and its part of their distance. */
export type ComparedChannel = Answer<"ChannelComparison">;
export type Comparison = Answer<"ComparisonAnswer">;
export type Spectrum = Answer<"SpectrumAnswer">;

export type Interval = Answer<"Interval">;
export type Measures = Answer<"Measures">;
export type ByModel = Record<string, number>;
export type Evaluation = Answer<"EvaluationAnswer">;

/** The body of a model that is to be made; the service checks what its method takes. */
export interface NewModel {
  name: string;
  method: string;
  parameters?: Record<string, Json>;
  training?: Record<string, Json>;
}
