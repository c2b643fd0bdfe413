// All collections, and making a new one.

import { useCallback, useState } from "preact/hooks";
import { ask, type Problem } from "../../api/client";
import type { Collection, Page } from "../../api/types";
import { go, linkTo } from "../../router";
import { DemoButton } from "../../ui/demo";
import { Bar, Dialog, Empty, Field, Heading, Trouble } from "../../ui/basics";
import { asProblem, useEvery, useLoad } from "../../ui/loading";
import { count } from "../../ui/words";
import { isHiddenCollection } from "./deleting";
import { DescriptionField, ModelSelect, NameField } from "./fields";

const AGAIN_MILLISECONDS = 5000;

export function CollectionList() {
  const [isMaking, setMaking] = useState(false);
  const all = useLoad<Page<Collection>>((signal) => ask("v1/collections?limit=1000", { signal }), []);
  const { again, isLoading } = all;
  const soon = useCallback(() => void (isLoading || again()), [isLoading, again]);
  useEvery(AGAIN_MILLISECONDS, soon);
  const shown = all.value?.items.filter((collection) => !isHiddenCollection(collection));
  return (
    <>
      <Heading title="Collections" hint="Sets of shapes, each searched as one.">
        <button type="button" class="main" onClick={() => setMaking(true)}>
          Make a collection
        </button>
      </Heading>
      <Trouble problem={all.problem} again={all.again} />
      {shown === undefined && all.isLoading && <p class="loading">Loading…</p>}
      {shown?.length === 0 && (
        <Empty title="There are no collections yet">
          <p>
            Make one and add meshes to it, or look around in one of creatures first.
          </p>
          <DemoButton />
        </Empty>
      )}
      {shown !== undefined && shown.length > 0 && (
        <ul class="collections">
          {shown.map((collection) => (
            <Row key={collection.name} collection={collection} />
          ))}
        </ul>
      )}
      {isMaking && <Making close={() => setMaking(false)} />}
    </>
  );
}

function Row(props: { collection: Collection }) {
  const { collection } = props;
  return (
    <li>
      <a class="card collection" href={linkTo(["collections", collection.name])}>
        <strong class="name">{collection.name}</strong>
        {collection.description && <span class="about">{collection.description}</span>}
        <span class="quiet">
          {count(collection.shape_count, "shape")} · model {collection.model}
        </span>
        <Described collection={collection} />
      </a>
    </li>
  );
}

/** How many of a collection's shapes can be found, and how many never will. */
export function Described(props: { collection: Collection }) {
  const { shape_count: all, ready_count: ready, failed_count: failed } = props.collection;
  if (all === 0) return <span class="described quiet">It is empty.</span>;
  return (
    <span class="described">
      <Bar value={ready / all} label="described" />
      <span class="quiet">
        {ready === all ? "all described" : `${ready} of ${all} described`}
        {failed > 0 && <span class="failed"> · {failed} failed</span>}
      </span>
    </span>
  );
}

function Making(props: { close: () => void }) {
  const [name, setName] = useState("");
  const [description, setDescription] = useState("");
  const [model, setModel] = useState("");
  const [problem, setProblem] = useState<Problem | null>(null);
  const [isBusy, setBusy] = useState(false);
  const make = async () => {
    setBusy(true);
    try {
      const json = { name, description, ...(model && { model }) };
      const made = await ask<Collection>("v1/collections", { json });
      go(linkTo(["collections", made.name]));
    } catch (error) {
      setProblem(asProblem(error));
      setBusy(false);
    }
  };
  return (
    <Dialog title="Make a collection" close={props.close}>
      <form
        onSubmit={(event) => {
          event.preventDefault();
          void make();
        }}
      >
        <Trouble problem={problem} />
        <NameField value={name} set={setName} />
        <DescriptionField value={description} set={setDescription} />
        <Field label="Model" hint="How its shapes are described and compared. It can be changed later.">
          {(id) => <ModelSelect id={id} value={model} set={setModel} none="The service's default" />}
        </Field>
        <button type="submit" class="main" disabled={isBusy}>
          Make it
        </button>
      </form>
    </Dialog>
  );
}
