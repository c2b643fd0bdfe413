// Before a query: where to drop a mesh, and stored shapes to begin with.

import { useRef, useState } from "preact/hooks";
import { ask } from "../../api/client";
import type { Page, Shape } from "../../api/types";
import { linkTo } from "../../router";
import { Thumbnail } from "../../ui/basics";
import { useLoad } from "../../ui/loading";
import { count, fileName } from "../../ui/words";

const SHOWN = 12;

/** A place for a mesh: dropped, chosen, or pasted with the keyboard's way to the button. */
export function DropZone(props: { send: (file: File) => void; isBusy: boolean; small?: boolean }) {
  const input = useRef<HTMLInputElement>(null);
  const [isOver, setOver] = useState(false);
  const take = (files: FileList | null | undefined) => {
    const file = files?.[0];
    if (file) props.send(file);
  };
  return (
    <div
      class={`dropzone${isOver ? " over" : ""}${props.small ? " small" : ""}`}
      onDragOver={(event) => {
        event.preventDefault();
        setOver(true);
      }}
      onDragLeave={() => setOver(false)}
      onDrop={(event) => {
        event.preventDefault();
        setOver(false);
        take(event.dataTransfer?.files);
      }}
    >
      {!props.small && <h2>Drop a mesh here</h2>}
      <input
        ref={input}
        class="unseen"
        type="file"
        tabIndex={-1}
        aria-label="Mesh to search with"
        onChange={(event) => {
          take(event.currentTarget.files);
          event.currentTarget.value = "";
        }}
      />
      <button type="button" class="main" disabled={props.isBusy} onClick={() => input.current?.click()}>
        {props.small ? "Another mesh" : "Choose a mesh"}
      </button>
      {!props.small && <p class="quiet">OFF, OBJ, PLY, STL, glTF, 3MF, VTK and others, compressed or not. It is not added to the collection.</p>}
    </div>
  );
}

/** The first visit: drop a mesh, or begin with one that is there. */
export function Start(props: { collection: string; count: number; send: (file: File) => void; isBusy: boolean }) {
  const { collection } = props;
  const shapes = useLoad(
    (signal) => ask<Page<Shape>>(`v1/collections/${collection}/shapes?state=ready&limit=120`, { signal }),
    [collection],
  );
  const all = shapes.value?.items ?? [];
  const step = Math.max(1, Math.floor(all.length / SHOWN));
  const some = all.filter((_, i) => i % step === 0).slice(0, SHOWN);
  return (
    <>
      <DropZone send={props.send} isBusy={props.isBusy} />
      {some.length > 0 && (
        <section class="examples">
          <h2>
            Or begin with a shape of <a href={linkTo(["collections", collection])}>{collection}</a>,{" "}
            {count(props.count, "shape")}
          </h2>
          <ul class="cards">
            {some.map((shape) => (
              <li key={shape.id}>
                <a class="card" href={linkTo(["search", collection], { shape: shape.id })}>
                  <Thumbnail shape={shape} />
                  <span class="name">{shape.label ?? fileName(shape.name)}</span>
                  {shape.label && <small class="quiet">{fileName(shape.name)}</small>}
                </a>
              </li>
            ))}
          </ul>
        </section>
      )}
    </>
  );
}
