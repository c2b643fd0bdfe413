import { describe, expect, it } from "vitest";
import type { Job, Shape } from "../../api/types";
import { cleanPath, filesOf, nextBatch, outcomes } from "./batches";
import { pickChosen, pickDropped, type Picked, type Sent } from "./files";
import { clutter, isArchive, isMesh } from "./kinds";

/** Files as a browser gives those of a folder. */
function files(content: Record<string, BlobPart>): File[] {
  return Object.entries(content).map(([path, data]) => {
    const file = new File([data], path.split("/").at(-1)!);
    return Object.defineProperty(file, "webkitRelativePath", { value: path.includes("/") ? path : "" });
  });
}

function gltf(...names: string[]): string {
  const [buffers, images] = [names.slice(0, 1), names.slice(1)].map((uris) => uris.map((uri) => ({ uri })));
  return JSON.stringify({ asset: { version: "2.0" }, buffers, images });
}

function namesOf(picked: readonly { name: string }[]): string[] {
  return picked.map(({ name }) => name);
}

async function sentOf(content: Record<string, BlobPart>): Promise<Sent[]> {
  return (await pickChosen(files(content))).files;
}

function answer(shapes: string[], skipped: [item: string, detail: string][] = []): [Job, Shape[]] {
  const job = { skipped: skipped.map(([item, detail]) => ({ item, detail })) } as Job;
  return [job, shapes.map((path) => ({ id: path, path }) as Shape)];
}

describe("names", () => {
  it("say what is a mesh, compressed or not", () => {
    for (const name of ["a.off", "a.PLY", "a.ply.gz", "a.b.gltf", "a.vtp", "a.gii.xz"]) expect(isMesh(name)).toBe(true);
    for (const name of ["a.png", "a.zip", "off", ".off", "a.gz", "a"]) expect(isMesh(name)).toBe(false);
  });

  it("say what is an archive", () => {
    for (const name of ["a.zip", "a.tar.gz", "a.tgz", "A.TAR", "models.xz"]) expect(isArchive(name)).toBe(true);
    for (const name of ["a.off", "a.off.gz", "a.3mf", "zip"]) expect(isArchive(name)).toBe(false);
  });

  it("say what is clutter", () => {
    expect(["a.PNG", "read me.txt", "a.mtl", "a.bin", "a.off", "lh.pial"].map(clutter)).toEqual([
      "picture",
      "text",
      "material file",
      null,
      null,
      null,
    ]);
  });
});

describe("files of a folder", () => {
  it("are sent under their whole paths, and clutter is named", async () => {
    const picked = await pickChosen(
      files({
        "zoo/cats/1.off": "OFF",
        "zoo/cats/1.png": "",
        "zoo/licence.txt": "",
        "zoo/.hidden/2.off": "OFF",
        "zoo/__MACOSX/3.off": "OFF",
      }),
    );
    expect(namesOf(picked.files)).toEqual(["zoo/cats/1.off"]);
    expect(picked.skipped).toEqual([
      { item: "zoo/cats/1.png", detail: "picture" },
      { item: "zoo/licence.txt", detail: "text" },
    ]);
  });

  it("are sent whatever they are if they come alone", async () => {
    const alone: Picked = await pickChosen(files({ "notes.txt": "v 0 0 0" }));
    expect(namesOf(alone.files)).toEqual(["notes.txt"]);
    expect((await pickChosen(files({ "zoo/notes.txt": "" }))).files).toEqual([]);
    expect((await pickChosen(files({ "a.png": "", "b.png": "" }))).skipped).toHaveLength(2);
  });

  it("that glTF refers to come with it", async () => {
    const [scene, ...others] = await sentOf({
      "zoo/scene.gltf": gltf("scene.bin", "textures/skin%20one.png", "../up.jpg", "data:image/png;base64,AA", "https://a/b.png"),
      "zoo/scene.bin": "\0",
      "zoo/textures/Skin one.png": "",
      "zoo/other.bin": "\0",
      "up.jpg": "",
    });
    expect(namesOf(scene!.needs)).toEqual(["zoo/scene.bin", "zoo/textures/Skin one.png", "up.jpg"]);
    expect(namesOf(others)).toEqual(["zoo/other.bin"]);
  });

  it("that glTF refers to are found without folders too", async () => {
    const [scene] = await sentOf({ "scene.gltf": gltf("buffers/a.bin", "b.png"), "a.bin": "\0", "b.png": "", "c.png": "" });
    expect(namesOf(scene!.needs)).toEqual(["a.bin", "b.png"]);
  });

  it("that a GLB refers to come with it, and a broken file needs none", async () => {
    const json = gltf("a.bin");
    const head = new DataView(new ArrayBuffer(20));
    new TextEncoder().encode("glTF").forEach((byte, i) => head.setUint8(i, byte));
    head.setUint32(12, json.length, true);
    const glb = new Blob([head.buffer, json, "and more"]);
    const sent = await sentOf({ "a.glb": glb as unknown as BlobPart, "a.bin": "\0", "broken.gltf": "{", "null.gltf": "null" });
    expect(sent.map(({ name, needs }) => [name, namesOf(needs)])).toEqual([
      ["a.glb", ["a.bin"]],
      ["broken.gltf", []],
      ["null.gltf", []],
    ]);
  });
});

/** A file or folder as a browser gives what was dropped; folders tell their entries in two pieces. */
function entry(path: string, content: string | FileSystemEntry[] | null): FileSystemEntry {
  const own = { name: path.split("/").at(-1)!, fullPath: path, isDirectory: Array.isArray(content) };
  if (!Array.isArray(content)) {
    const file = (resolve: (file: File) => void, reject: (error: Error) => void) =>
      content === null ? reject(new Error("gone")) : resolve(new File([content], own.name));
    return { ...own, file } as unknown as FileSystemEntry;
  }
  const pieces = [content.slice(0, 1), content.slice(1), []];
  const createReader = () => ({ readEntries: (resolve: (some: FileSystemEntry[]) => void) => resolve(pieces.shift()!) });
  return { ...own, createReader } as unknown as FileSystemEntry;
}

describe("what is dropped", () => {
  it("is walked through, and what cannot be read is named", async () => {
    const cats = entry("/zoo/cats", [entry("/zoo/cats/2.off", "OFF"), entry("/zoo/cats/gone.off", null)]);
    const dropped = entry("/zoo", [entry("/zoo/z.off", "OFF"), cats, entry("/zoo/.git", [entry("/zoo/.git/a.off", "OFF")])]);
    const loose = new File(["OFF"], "loose.off");
    const items = [
      { kind: "file", webkitGetAsEntry: () => dropped, getAsFile: () => null },
      { kind: "file", webkitGetAsEntry: () => null, getAsFile: () => loose },
      { kind: "string" },
    ];
    const picked = await pickDropped({ items } as unknown as DataTransfer);
    expect(namesOf(picked.files)).toEqual(["zoo/cats/2.off", "zoo/z.off", "loose.off"]);
    expect(picked.skipped).toEqual([{ item: "zoo/cats/gone.off", detail: "could not be read" }]);
  });
});

describe("requests", () => {
  it("hold twenty files, and archives alone", async () => {
    const meshes = Object.fromEntries(Array.from({ length: 25 }, (_, i) => [`${i}.off`, "OFF"]));
    const queue = await sentOf({ ...meshes, "a.zip": "", "b.tar.gz": "", "c.off": "OFF" });
    const sizes: number[] = [];
    while (queue.length) sizes.push(nextBatch(queue).length);
    expect(sizes).toEqual([20, 5, 1, 1, 1]);
  });

  it("never part glTF from its files", async () => {
    const pictures = Array.from({ length: 30 }, (_, i) => `${i}.png`);
    const content = Object.fromEntries(pictures.map((name) => [`zoo/${name}`, ""]));
    const queue = await sentOf({
      "zoo/0.off": "OFF",
      "zoo/scene.gltf": gltf("scene.bin", ...pictures),
      "zoo/scene.bin": "\0",
      ...content,
      "zoo/1.off": "OFF",
    });
    expect(namesOf(nextBatch(queue))).toEqual(["zoo/0.off"]);
    const scene = nextBatch(queue);
    expect(namesOf(scene)).toEqual(["zoo/scene.gltf"]);
    expect(filesOf(scene)).toHaveLength(32);
    expect(namesOf(nextBatch(queue))).toEqual(["zoo/1.off"]);
  });

  it("hold a mesh where nothing else in them is surely one", async () => {
    const [, unknown, mesh] = await sentOf({ "zoo/big.off": "OFF 12345", "zoo/lh.pial": "?", "zoo/z.off": "OFF" });
    expect(namesOf(filesOf([unknown!]))).toEqual(["zoo/lh.pial", "zoo/z.off"]);
    expect(namesOf(filesOf([unknown!, mesh!]))).toEqual(["zoo/lh.pial", "zoo/z.off"]);
  });
});

describe("what became of files", () => {
  it("is told by their order, without those that were skipped", async () => {
    const batch = await sentOf({
      "zoo/a.off": "OFF a",
      "zoo/scene.gltf": gltf("scene.bin"),
      "zoo/scene.bin": "\0",
      "zoo/unknown": "?",
      "zoo/b.off": "OFF b",
    });
    const told = await outcomes(batch, ...answer(["old/a.off", "zoo/scene.gltf", "zoo/b.off"], [["zoo/unknown", "file"]]));
    expect(told.map((one) => ("shape" in one ? one.shape?.id : one.skipped.detail))).toEqual([
      "old/a.off",
      "zoo/scene.gltf",
      "file",
      "zoo/b.off",
    ]);
  });

  it("is one shape for equal files, and that of a mesh that only came beside is nobody's", async () => {
    const equal = await sentOf({ "a.off": "OFF a", "b.off": "OFF b", "c.off": "OFF a" });
    const told = await outcomes(equal, ...answer(["a.off", "b.off"]));
    expect(told.map((one) => "shape" in one && one.shape?.id)).toEqual(["a.off", "b.off", "a.off"]);
    const [, unknown] = await sentOf({ "zoo/a.off": "OFF a", "zoo/lh.pial": "?" });
    const [left] = await outcomes([unknown!], ...answer(["zoo/a.off"], [["zoo/lh.pial", "file"]]));
    expect(left).toEqual({ skipped: { item: "zoo/lh.pial", detail: "file" } });
    const [found] = await outcomes([unknown!], ...answer(["zoo/lh.pial", "zoo/a.off"]));
    expect(found).toMatchObject({ shape: { id: "zoo/lh.pial" } });
  });

  it("is known without a job that names what was skipped", async () => {
    const batch = await sentOf({ "zoo/a.off": "OFF a", "zoo/unknown": "?" });
    const told = await outcomes(batch, ...answer(["zoo/a.off"]));
    expect(told).toMatchObject([{ shape: { id: "zoo/a.off" } }, { skipped: { item: "zoo/unknown" } }]);
  });
});

describe("paths", () => {
  it("are written as the service stores them", () => {
    expect(cleanPath("/zoo//./cats\\1.off")).toBe("zoo/cats/1.off");
    expect(cleanPath("a\u0308.off")).toBe("ä.off");
  });
});
