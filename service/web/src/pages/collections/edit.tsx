// Another name or description for a collection.

import { useState } from "preact/hooks";
import { ask, type Problem } from "../../api/client";
import type { Collection } from "../../api/types";
import { go, linkTo } from "../../router";
import { Dialog, Trouble } from "../../ui/basics";
import { asProblem } from "../../ui/loading";
import { DescriptionField, NameField } from "./fields";
import { renameUploads } from "./uploads";

export function Editing(props: { collection: Collection; close: () => void; changed: () => void }) {
  const before = props.collection;
  const [name, setName] = useState(before.name);
  const [description, setDescription] = useState(before.description);
  const [problem, setProblem] = useState<Problem | null>(null);
  const [isBusy, setBusy] = useState(false);
  const save = async () => {
    setBusy(true);
    try {
      const json = {
        ...(name !== before.name && { name }),
        ...(description !== before.description && { description }),
      };
      const after = await ask<Collection>(`v1/collections/${before.name}`, { method: "PATCH", json });
      props.close();
      if (after.name === before.name) return props.changed();
      renameUploads(before.name, after.name);
      go(linkTo(["collections", after.name]), { replace: true });
    } catch (error) {
      setProblem(asProblem(error));
      setBusy(false);
    }
  };
  return (
    <Dialog title={`Edit ${before.name}`} close={props.close}>
      <form
        onSubmit={(event) => {
          event.preventDefault();
          void save();
        }}
      >
        <Trouble problem={problem} />
        <NameField value={name} set={setName} />
        <DescriptionField value={description} set={setDescription} />
        <button type="submit" class="main" disabled={isBusy}>
          Save
        </button>
      </form>
    </Dialog>
  );
}
