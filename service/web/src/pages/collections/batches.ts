// What goes into one request, and which of the shapes in its answer each file is.

import type { Job, Shape } from "../../api/types";
import type { Named, Sent, Skipped } from "./files";
import { isArchive } from "./kinds";

const BATCH_FILES = 20;
const BATCH_BYTES = 32 * 1024 ** 2;

/** What became of a file that was sent: a shape, which may not be known, or nothing. */
export type Outcome = { shape: Shape | null } | { skipped: Skipped };

/** Take from a queue what goes into one request; an archive goes alone, so that its job is its own. */
export function nextBatch<One extends Sent>(queue: One[]): One[] {
  let [bytes, files, taken] = [0, 0, 0];
  for (const one of queue) {
    const all = [one, ...one.needs];
    const size = all.reduce((sum, { file }) => sum + file.size, 0);
    const isFull = files + all.length > BATCH_FILES || bytes + size > BATCH_BYTES;
    if (taken > 0 && (isFull || isArchive(one.name))) break;
    taken++;
    files += all.length;
    bytes += size;
    if (isArchive(one.name)) break;
  }
  return queue.splice(0, taken);
}

/** The files of a request: those of a batch, each with what it needs, and a mesh beside what may be none. */
export function filesOf(batch: readonly Sent[]): Named[] {
  const files = new Map<File, Named>();
  for (const one of batch) for (const { file, name } of [one, ...one.needs]) files.set(file, { file, name });
  const beside = batch.every((one) => one.beside !== null) ? batch[0]?.beside : null;
  if (beside) files.set(beside.file, { file: beside.file, name: beside.name });
  return [...files.values()];
}

/** What became of each file of a batch: shapes come in the order of the files, equal files being one. */
export async function outcomes(batch: readonly Sent[], job: Job, shapes: readonly Shape[]): Promise<Outcome[]> {
  if (batch.some(({ name }) => isArchive(name))) return batch.map(() => ({ shape: null }));
  const skipped = new Map(job.skipped.map((one) => [one.item, one]));
  const needed = new Set(batch.flatMap(({ needs }) => needs.map(({ file }) => file)));
  const tried = filesOf(batch).filter(({ file, name }) => !needed.has(file) && !skipped.has(cleanPath(name)));
  const found = await pairUp(tried, shapes);
  return batch.map(({ file, name, beside }) => {
    const left = skipped.get(cleanPath(name));
    if (left) return { skipped: left };
    const shape = found.get(file) ?? null;
    // of shapes that another job computes, that one is answered, and does not name what is skipped here
    const isNone = shape === null && beside !== null && shapes.length < tried.length;
    return isNone ? { skipped: { item: cleanPath(name), detail: "file" } } : { shape };
  });
}

async function pairUp(tried: readonly Named[], shapes: readonly Shape[]): Promise<Map<File, Shape>> {
  const firsts: File[] = [];
  const places: number[] = [];
  for (const { file } of tried) {
    let place = shapes.length === tried.length ? firsts.length : 0;
    while (place < firsts.length && !(await areEqual(firsts[place]!, file))) place++;
    if (place === firsts.length) firsts.push(file);
    places.push(place);
  }
  if (firsts.length === shapes.length) return new Map(tried.map(({ file }, i) => [file, shapes[places[i]!]!]));
  const byPath = new Map(shapes.map((shape) => [shape.path, shape]));
  const pairs = tried.map(({ file, name }) => [file, byPath.get(cleanPath(name))] as const);
  return new Map(pairs.filter((pair): pair is [File, Shape] => pair[1] !== undefined));
}

async function areEqual(one: File, other: File): Promise<boolean> {
  if (one.size !== other.size) return false;
  const [a, b] = await Promise.all([one.arrayBuffer(), other.arrayBuffer()]);
  const [x, y] = [new Uint8Array(a), new Uint8Array(b)];
  return x.every((value, i) => value === y[i]);
}

/** A path as the service stores it, but for those that are too long or not printable. */
export function cleanPath(name: string): string {
  const parts = name.normalize("NFC").replaceAll("\\", "/").split("/");
  return parts.filter((part) => !["", ".", ".."].includes(part)).join("/");
}
