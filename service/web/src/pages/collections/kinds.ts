// What a file is by its name, by the service's own lists: they decide what an upload sends.

import { ARCHIVES, CLUTTER, COMPRESSED, MESHES } from "../../api/endings";

function endingOf(name: string): string {
  const dot = name.lastIndexOf(".");
  return dot > 0 ? name.slice(dot + 1).toLowerCase() : "";
}

/** "cat.ply" of "cat.ply.gz". */
function innerName(name: string): string {
  return COMPRESSED.has(endingOf(name)) ? name.slice(0, name.lastIndexOf(".")) : name;
}

export function isMesh(name: string): boolean {
  return MESHES.has(endingOf(innerName(name)));
}

/** Whether many shapes may come out of it; so may they out of what is compressed and called like no mesh. */
export function isArchive(name: string): boolean {
  const inner = innerName(name);
  return ARCHIVES.has(endingOf(inner)) || (inner !== name && !isMesh(name));
}

/** "picture", "text" and so on of what is never a mesh; null where the content decides. */
export function clutter(name: string): string | null {
  return CLUTTER.get(endingOf(name)) ?? null;
}

/** What systems put into folders and archives without being asked. */
export function isHidden(name: string): boolean {
  return name.startsWith(".") || name === "__MACOSX";
}
