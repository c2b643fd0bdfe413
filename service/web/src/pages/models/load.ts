// Models and collections, all of them.

import { ask } from "../../api/client";
import type { Collection, Job, Model, Page } from "../../api/types";
import { useLoad, type Loaded } from "../../ui/loading";

const MOST = 1000;
const MOST_PAGES = 20;

export function useModels(): Loaded<Model[]> {
  return useLoad((signal) => ask<Page<Model>>(`v1/models?limit=${MOST}`, { signal }).then((page) => page.items), []);
}

export function useCollections(): Loaded<Collection[]> {
  return useLoad(
    (signal) => ask<Page<Collection>>(`v1/collections?limit=${MOST}`, { signal }).then((page) => page.items),
    [],
  );
}

/** The newest job that trains a model; null if it is not known any more. */
export async function findTraining(model: string, signal: AbortSignal): Promise<Job | null> {
  let cursor: string | null = "";
  for (let page = 0; page < MOST_PAGES && cursor !== null; page++) {
    const after: string = cursor && `&cursor=${encodeURIComponent(cursor)}`;
    const found: Page<Job> = await ask(`v1/jobs?kind=train&limit=200${after}`, { signal });
    const job = found.items.find((one) => one.model === model);
    if (job) return job;
    cursor = found.next_cursor;
  }
  return null;
}
