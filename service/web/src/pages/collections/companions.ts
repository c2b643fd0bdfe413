// Files that a glTF file refers to: they go into its request, where the service joins them.

import type { Named } from "./files";

const GLTF = /\.gl(tf|b)$/i;
const SCHEME = /^[a-z][a-z0-9+.-]+:/i; // two letters or more: C: is a disk
const GLB_HEAD = 20; // bytes before its JSON, of which the length stands at 12

/** Find files by what another refers to, as the service does: by path, by path in any case, by a name only one has. */
export class Neighbours {
  private readonly paths = new Map<string, Named>();
  private readonly folded = new Map<string, Named>();
  private readonly names = new Map<string, Named | null>();

  constructor(files: readonly Named[]) {
    for (const file of files) {
      const path = normal(file.name);
      const name = lastOf(path).toLowerCase();
      if (!this.paths.has(path)) this.paths.set(path, file);
      if (!this.folded.has(path.toLowerCase())) this.folded.set(path.toLowerCase(), file);
      this.names.set(name, this.names.has(name) ? null : file);
    }
  }

  find(from: string, reference: string): Named | null {
    const folder = from.slice(0, from.lastIndexOf("/") + 1);
    const path = normal(folder + reference.replaceAll("\\", "/"));
    const known = this.paths.get(path) ?? this.folded.get(path.toLowerCase());
    return known ?? this.names.get(lastOf(path).toLowerCase()) ?? null;
  }
}

/** What a file needs of those beside it; nothing unless it is glTF. */
export async function needsOf(one: Named, neighbours: Neighbours): Promise<Named[]> {
  if (!GLTF.test(one.name)) return [];
  const found = (await referencesOf(one.file)).map((reference) => neighbours.find(one.name, reference));
  return [...new Set(found)].filter((file) => file !== null && file !== one) as Named[];
}

/** Paths that a glTF file names; none of what cannot be read, of which the service says what is wrong. */
async function referencesOf(file: File): Promise<string[]> {
  try {
    const document = JSON.parse((await jsonOf(file)).replace(/^\uFEFF/, "")) as Record<string, unknown>;
    return [document.buffers, document.images].flatMap((items) => (Array.isArray(items) ? items : [])).flatMap(nameOf);
  } catch {
    return [];
  }
}

async function jsonOf(file: File): Promise<string> {
  const head = await file.slice(0, GLB_HEAD).arrayBuffer();
  const isGlb = head.byteLength === GLB_HEAD && new TextDecoder().decode(head.slice(0, 4)) === "glTF";
  if (!isGlb) return file.text();
  return file.slice(GLB_HEAD, GLB_HEAD + new DataView(head).getUint32(12, true)).text();
}

function nameOf(item: { uri?: unknown } | null): string[] {
  const uri = item?.uri;
  if (typeof uri !== "string") return [];
  const own = uri.replace(/^file:\/*/i, "");
  return SCHEME.test(own) ? [] : [decoded(own)];
}

function decoded(uri: string): string {
  try {
    return decodeURIComponent(uri);
  } catch {
    return uri;
  }
}

/** A path without "." and with ".." resolved, however letters with accents are written. */
function normal(path: string): string {
  const parts: string[] = [];
  for (const part of path.normalize("NFC").split("/")) {
    if (part === "..") parts.pop();
    else if (part !== "" && part !== ".") parts.push(part);
  }
  return parts.join("/");
}

function lastOf(path: string): string {
  return path.slice(path.lastIndexOf("/") + 1);
}
