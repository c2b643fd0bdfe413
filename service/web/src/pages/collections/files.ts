// Which files an upload sends, and under which names: of drops, of chosen files, of whole folders.

import { needsOf, Neighbours } from "./companions";
import { clutter, isArchive, isHidden, isMesh } from "./kinds";

export interface Named {
  file: File;
  /** "animals/cat/17.ply" for a file within a folder: the service reads path and label from it. */
  name: string;
}

/** A file that is sent, and what must come with it. */
export interface Sent extends Named {
  /** Files that it refers to. */
  needs: Named[];
  /**
   * A mesh that came with it, where its own name does not say that it is one: beside that the service skips it
   * if it is none; alone it would fail.
   */
  beside: Named | null;
}

export interface Skipped {
  item: string;
  detail: string;
}

export interface Picked {
  files: Sent[];
  /** What is left alone, and what it is; that of the files sent comes from the service. */
  skipped: Skipped[];
}

interface Found {
  files: Named[];
  unread: string[];
}

/** Files that a person chose in a dialog, single ones or those of a folder. */
export function pickChosen(files: Iterable<File>): Promise<Picked> {
  const found = [...files].map((file) => ({ file, name: file.webkitRelativePath || file.name }));
  return sortOut({ files: found, unread: [] });
}

/** Files that were dropped, with all that is in dropped folders. */
export async function pickDropped(transfer: DataTransfer): Promise<Picked> {
  // the drop can be read only now, so that everything is taken out of it before anything is awaited
  const dropped = Array.from(transfer.items)
    .filter((item) => item.kind === "file")
    .map((item) => ({ entry: item.webkitGetAsEntry(), file: item.getAsFile() }));
  const found: Found = { files: [], unread: [] };
  for (const { entry, file } of dropped) {
    if (entry?.isDirectory) await walk(entry as FileSystemDirectoryEntry, found);
    else if (file) found.files.push({ file, name: file.name });
  }
  return sortOut(found);
}

async function walk(folder: FileSystemDirectoryEntry, found: Found): Promise<void> {
  if (isHidden(folder.name)) return;
  const entries = await entriesOf(folder).catch(() => {
    found.unread.push(pathOf(folder));
    return [];
  });
  for (const entry of entries.sort((a, b) => a.name.localeCompare(b.name))) {
    if (entry.isDirectory) {
      await walk(entry as FileSystemDirectoryEntry, found);
      continue;
    }
    const file = await fileOf(entry as FileSystemFileEntry).catch(() => null);
    if (file) found.files.push({ file, name: pathOf(entry) });
    else found.unread.push(pathOf(entry));
  }
}

/** A folder's entries, which a browser gives a hundred at a time. */
async function entriesOf(folder: FileSystemDirectoryEntry): Promise<FileSystemEntry[]> {
  const reader = folder.createReader();
  const all: FileSystemEntry[] = [];
  for (;;) {
    const some = await new Promise<FileSystemEntry[]>((resolve, reject) => reader.readEntries(resolve, reject));
    if (some.length === 0) return all;
    all.push(...some);
  }
}

function fileOf(entry: FileSystemFileEntry): Promise<File> {
  return new Promise((resolve, reject) => entry.file(resolve, reject));
}

function pathOf(entry: FileSystemEntry): string {
  return entry.fullPath.replace(/^\/+/, "");
}

/** Tell what is sent from what is skipped; a file that comes alone is sent, whatever it is. */
async function sortOut({ files, unread }: Found): Promise<Picked> {
  const skipped = unread.map((item) => ({ item, detail: "could not be read" }));
  const isAlone = files.length === 1 && !files[0]!.name.includes("/");
  const seen = isAlone ? files : files.filter(({ name }) => !name.split("/").some(isHidden));
  const tried = isAlone ? files : seen.filter(({ name }) => clutter(name) === null);
  const neighbours = new Neighbours(seen);
  const needs = new Map<Named, Named[]>();
  for (const one of tried) needs.set(one, await needsOf(one, neighbours));
  const needed = new Set([...needs.values()].flat());
  const mesh = smallest(tried.filter((one) => isMesh(one.name) && needs.get(one)!.length === 0));
  for (const one of seen) {
    if (!needs.has(one) && !needed.has(one)) skipped.push({ item: one.name, detail: clutter(one.name) ?? "file" });
  }
  const sent = tried.filter((one) => !needed.has(one)).map((one): Sent => {
    return { ...one, needs: needs.get(one)!, beside: isMesh(one.name) || isArchive(one.name) ? null : mesh };
  });
  return { files: sent, skipped };
}

function smallest(files: readonly Named[]): Named | null {
  return files.reduce<Named | null>((least, one) => (least === null || one.file.size < least.file.size ? one : least), null);
}
