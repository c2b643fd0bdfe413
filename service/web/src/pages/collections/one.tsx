// One collection: what it is, what is being sent to it, its shapes.

import { useCallback, useState } from "preact/hooks";
import { ask } from "../../api/client";
import type { Collection } from "../../api/types";
import { go, linkTo } from "../../router";
import { Heading, Trouble } from "../../ui/basics";
import { useEvery, useLoad } from "../../ui/loading";
import { deleteCollection } from "./deleting";
import { AddButtons, DropAnywhere } from "./drop";
import { Editing } from "./edit";
import { Described } from "./list";
import { MovePanel } from "./move";
import { Shapes } from "./shapes";
import { UploadPanel } from "./upload_panel";
import { uploadsTo } from "./uploads";

const SOON_MILLISECONDS = 2000;
const AGAIN_MILLISECONDS = 10000;

export function OneCollection(props: { name: string }) {
  const path = `v1/collections/${encodeURIComponent(props.name)}`;
  const loaded = useLoad<Collection>((signal) => ask(path, { signal }), [path]);
  const collection = loaded.value;
  const uploads = uploadsTo(props.name);
  const isSettled = collection === null || collection.ready_count + collection.failed_count >= collection.shape_count;
  const { again, isLoading } = loaded;
  const soon = useCallback(() => void (isLoading || again()), [isLoading, again]);
  useEvery(isSettled && !uploads.isBusy.value ? AGAIN_MILLISECONDS : SOON_MILLISECONDS, soon);
  if (collection === null) {
    if (!loaded.problem) return <p class="loading">Loading…</p>;
    return (
      <>
        <Trouble problem={loaded.problem} again={loaded.again} />
        <a href={linkTo(["collections"])}>All collections</a>
      </>
    );
  }
  return (
    <>
      <Head collection={collection} changed={loaded.again} />
      {loaded.problem && !loaded.problem.isAway && <Trouble problem={loaded.problem} again={loaded.again} />}
      <MovePanel collection={collection} moved={loaded.again} />
      <UploadPanel uploads={uploads} />
      <Shapes
        collection={collection}
        isSettled={isSettled}
        changed={loaded.again}
        add={(picked) => uploads.add(picked)}
      />
      <DropAnywhere collection={collection.name} take={(picked) => uploads.add(picked)} />
    </>
  );
}

function Head(props: { collection: Collection; changed: () => void }) {
  const { collection } = props;
  const [isEditing, setEditing] = useState(false);
  const close = useCallback(() => setEditing(false), []);
  const remove = () => {
    deleteCollection(collection);
    go(linkTo(["collections"]));
  };
  return (
    <>
      <nav class="crumbs" aria-label="Where this is">
        <a href={linkTo(["collections"])}>Collections</a>
      </nav>
      <Heading title={collection.name} hint={collection.description || "It has no description."}>
        <a class="button main" href={linkTo(["search", collection.name])}>
          Search here
        </a>
        <AddButtons take={(picked) => uploadsTo(collection.name).add(picked)} />
        <button type="button" onClick={() => setEditing(true)}>
          Edit
        </button>
        <button type="button" class="danger" onClick={remove}>
          Delete
        </button>
      </Heading>
      <Described collection={collection} />
      {isEditing && <Editing collection={collection} close={close} changed={props.changed} />}
    </>
  );
}
