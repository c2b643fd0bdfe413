// Queries: with a stored shape, or with a mesh that the person has.

import { ask, Problem, send, upload } from "../../api/client";
import { watchJob } from "../../api/jobs";
import type { Job, QueryOptions, QueryResult } from "../../api/types";
import { filterOf, type Test } from "./filters";

/** The subject of a query. */
export type Subject = { kind: "shape"; id: string } | { kind: "query"; id: string };

/** What narrows a search, as it stands in the address. */
export interface Narrowing {
  model: string | null;
  tests: readonly Test[];
}

/** How many matches are fetched at once; fewer are shown as the slider says. */
export const MOST_MATCHES = 100;

/** Where a query that was sent is. */
export type Stage = { at: "sending"; share: number } | { at: "waiting"; job: Job | null } | { at: "searching" };

/** Mesh files of this tab's queries, by the id of the query. */
const files = new Map<string, File>();

export function fileOf(query: string): File | null {
  return files.get(query) ?? null;
}

export function optionsOf({ model, tests }: Narrowing): QueryOptions {
  const filter = filterOf(tests);
  return { limit: MOST_MATCHES, ...(model && { model }), ...(filter && { filter }) };
}

export function askWithShape(
  collection: string,
  shape: string,
  narrowing: Narrowing,
  signal: AbortSignal,
): Promise<QueryResult> {
  const json = { shape_id: shape, ...optionsOf(narrowing) };
  return ask<QueryResult>(`v1/collections/${collection}/query`, { json, signal });
}

/** Send a mesh as a query; the id under which its answer is found. */
export async function askWithMesh(
  collection: string,
  file: File,
  narrowing: Narrowing,
  report: (stage: Stage) => void,
  signal: AbortSignal,
): Promise<string> {
  const form = new FormData();
  form.append("mesh", file, file.name);
  for (const [name, value] of Object.entries(optionsOf(narrowing))) {
    form.append(name, typeof value === "object" ? JSON.stringify(value) : String(value));
  }
  report({ at: "sending", share: 0 });
  const path = `v1/collections/${collection}/query/mesh?wait=0`;
  const sent = await upload<{ query_id?: string }>(path, form, (share) => report({ at: "sending", share }), signal);
  const id = sent.answer.query_id ?? sent.location?.split("/").pop();
  if (!id) throw new Problem(-1, "The query cannot be found again", "The service gave it no address.");
  files.set(id, file);
  return id;
}

/** The answer to a query, once its mesh is described. */
export async function answerOf(
  query: string,
  report: (stage: Stage) => void,
  signal: AbortSignal,
): Promise<QueryResult> {
  for (;;) {
    const response = await send(`v1/queries/${query}`, { signal });
    if (response.status === 200) return (await response.json()) as QueryResult;
    const { job } = (await response.json()) as { job: Job };
    report({ at: "waiting", job });
    await watchJob(job.id, (newer) => report({ at: "waiting", job: newer }), signal);
    report({ at: "searching" });
  }
}

/** The mesh of a query: the person's own file, or what the service kept of it. */
export async function meshOf(query: string, signal: AbortSignal): Promise<File> {
  const own = files.get(query);
  if (own) return own;
  const response = await send(`v1/queries/${query}/mesh`, { signal });
  const header = response.headers.get("Content-Disposition") ?? "";
  const encoded = /filename\*=UTF-8''([^;]+)/.exec(header)?.[1];
  return new File([await response.blob()], encoded ? decodeURIComponent(encoded) : "mesh");
}
