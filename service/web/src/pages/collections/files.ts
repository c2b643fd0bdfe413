// Which files an upload sends, and under which names: of drops, of chosen files, of whole folders.

export interface Named {
  file: File;
  /** "cat/17.ply" for a file within a folder, which is its label then. */
  name: string;
}

export interface Picked {
  files: Named[];
  /** Names of what is neither a mesh nor a zip archive, or could not be read. */
  leftOut: string[];
}

const ENDINGS = [".off", ".obj", ".ply", ".stl", ".glb", ".gltf", ".3mf", ".zip"];
export const ACCEPTED = ENDINGS.join(",");

export function isArchive(name: string): boolean {
  return name.toLowerCase().endsWith(".zip");
}

/** Files that a person chose in a dialog, single ones or those of a folder. */
export function pickChosen(files: Iterable<File>): Picked {
  const picked: Picked = { files: [], leftOut: [] };
  for (const file of files) sortIn(picked, file.webkitRelativePath || file.name, file);
  return picked;
}

/** Files that were dropped, with all that is in dropped folders. */
export async function pickDropped(transfer: DataTransfer): Promise<Picked> {
  // the drop can be read only now, so that everything is taken out of it before anything is awaited
  const found = Array.from(transfer.items)
    .filter((item) => item.kind === "file")
    .map((item) => ({ entry: item.webkitGetAsEntry(), file: item.getAsFile() }));
  const picked: Picked = { files: [], leftOut: [] };
  for (const { entry, file } of found) {
    if (entry?.isDirectory) await walk(entry as FileSystemDirectoryEntry, picked);
    else if (file) sortIn(picked, file.name, file);
  }
  return picked;
}

async function walk(folder: FileSystemDirectoryEntry, picked: Picked): Promise<void> {
  if (isHidden(folder.name)) return;
  const entries = await entriesOf(folder).catch(() => {
    picked.leftOut.push(folder.name);
    return [];
  });
  for (const entry of entries.sort((a, b) => a.name.localeCompare(b.name))) {
    if (entry.isDirectory) {
      await walk(entry as FileSystemDirectoryEntry, picked);
      continue;
    }
    const file = await fileOf(entry as FileSystemFileEntry).catch(() => null);
    if (file) sortIn(picked, entry.fullPath, file);
    else picked.leftOut.push(entry.name);
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

function sortIn(picked: Picked, path: string, file: File): void {
  const parts = path.split("/").filter(Boolean);
  const own = parts.at(-1) ?? file.name;
  if (parts.some(isHidden)) return;
  if (ENDINGS.some((ending) => own.toLowerCase().endsWith(ending))) {
    picked.files.push({ file, name: parts.slice(-2).join("/") });
  } else picked.leftOut.push(own);
}

/** What systems put into folders and archives without being asked. */
function isHidden(name: string): boolean {
  return name.startsWith(".") || name === "__MACOSX";
}
