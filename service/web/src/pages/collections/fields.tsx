// Form fields of collections: name, description, model.

import { ask } from "../../api/client";
import type { Model, Page } from "../../api/types";
import { Field } from "../../ui/basics";
import { useLoad } from "../../ui/loading";

const RULE = "Small letters, digits, - and _, at most 63; it begins with a letter or a digit.";

export function NameField(props: { value: string; set: (value: string) => void }) {
  return (
    <Field label="Name" hint={RULE}>
      {(id) => (
        <input
          id={id}
          required
          autofocus
          autocomplete="off"
          autocapitalize="none"
          spellcheck={false}
          maxLength={63}
          pattern="[a-z0-9][a-z0-9_\-]*"
          title={RULE}
          value={props.value}
          onInput={(event) => props.set(event.currentTarget.value)}
        />
      )}
    </Field>
  );
}

export function DescriptionField(props: { value: string; set: (value: string) => void }) {
  return (
    <Field label="Description" hint="What it holds, in a sentence; it may be left empty.">
      {(id) => (
        <textarea
          id={id}
          rows={3}
          maxLength={2000}
          value={props.value}
          onInput={(event) => props.set(event.currentTarget.value)}
        />
      )}
    </Field>
  );
}

/** A choice among the models that are ready, other than one; "" is none of them. */
export function ModelSelect(props: {
  id: string;
  value: string;
  set: (value: string) => void;
  none: string;
  without?: string;
}) {
  const models = useLoad<Page<Model>>((signal) => ask("v1/models?limit=1000", { signal }), []);
  const ready = models.value?.items.filter(({ name, state }) => state === "ready" && name !== props.without) ?? [];
  return (
    <select id={props.id} value={props.value} onChange={(event) => props.set(event.currentTarget.value)}>
      <option value="">{props.none}</option>
      {ready.map(({ name }) => (
        <option key={name} value={name}>
          {name}
        </option>
      ))}
    </select>
  );
}
