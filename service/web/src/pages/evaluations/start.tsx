// The form in which an evaluation is begun.

import { useState } from "preact/hooks";
import { ask, type Problem } from "../../api/client";
import type { Collection, Evaluation, Model } from "../../api/types";
import { go, linkTo, route } from "../../router";
import { Empty, Field, Heading, Trouble } from "../../ui/basics";
import { asProblem } from "../../ui/loading";
import { count } from "../../ui/words";
import { useCollections, useModels } from "../models/load";
import { summary } from "../models/words";
import { DISSIMILARITIES } from "./words";

const MOST_MODELS = 20;

export function NewEvaluation() {
  const collections = useCollections();
  const models = useModels();
  const isThere = collections.value !== null && models.value !== null;
  return (
    <>
      <Heading
        title="Evaluate models"
        hint={
          <>
            <a href={linkTo(["evaluations"])}>Evaluations</a> · Shapes are asked with, one after the other, and it is
            counted how early what belongs to them is found.
          </>
        }
      />
      <Trouble problem={collections.problem ?? models.problem} />
      {!isThere && !(collections.problem ?? models.problem) && <p class="loading">Loading…</p>}
      {isThere && collections.value!.length === 0 && (
        <Empty title="There is nothing to evaluate on yet">
          <p>Make a collection of shapes with labels first.</p>
          <a class="button main" href={linkTo(["collections"])}>
            Go to the collections
          </a>
        </Empty>
      )}
      {isThere && collections.value!.length > 0 && (
        <Form
          collections={collections.value!}
          models={models.value!.filter((model) => model.state === "ready")}
        />
      )}
    </>
  );
}

function Form(props: { collections: Collection[]; models: Model[] }) {
  const { collections, models } = props;
  const { query } = route.value;
  const asked = (query.get("models") ?? "").split(",").filter((name) => models.some((model) => model.name === name));
  const [name, setName] = useState(query.get("collection") ?? "");
  const collection = collections.find((one) => one.name === name) ?? collections[0]!;
  const own = models.find((model) => model.name === collection.model)?.name;
  const [ticked, setChosen] = useState<string[] | null>(asked.length ? asked : null);
  const chosen = ticked ?? (own ? [own] : []);
  const [first, setFirst] = useState("");
  const [dissimilarity, setDissimilarity] = useState("");
  const [problem, setProblem] = useState<Problem | null>(null);
  const [isSending, setSending] = useState(false);
  const base = chosen.includes(first) ? first : chosen[0];
  const send = async () => {
    setSending(true);
    setProblem(null);
    const ordered = [base!, ...chosen.filter((model) => model !== base)];
    try {
      const json = { collection: collection.name, models: ordered, ...(dissimilarity && { dissimilarity }) };
      const made = await ask<{ evaluation: Evaluation }>("v1/evaluations", { json });
      go(linkTo(["evaluations", made.evaluation.id]));
    } catch (error) {
      setProblem(asProblem(error));
      setSending(false);
    }
  };
  return (
    <form
      class="panel start"
      onSubmit={(event) => {
        event.preventDefault();
        void send();
      }}
    >
      <CollectionChoice collections={collections} name={collection.name} choose={setName} />
      <ModelChoice models={models} chosen={chosen} choose={setChosen} />
      {chosen.length > 1 && <FirstChoice models={chosen} first={base!} choose={setFirst} />}
      <DissimilarityChoice chosen={dissimilarity} choose={setDissimilarity} />
      <Trouble problem={problem} />
      <div class="row">
        <button type="submit" class="main" disabled={isSending || chosen.length === 0}>
          Evaluate
        </button>
        {chosen.length === 0 && <span class="quiet">Choose at least one model.</span>}
        <a href={linkTo(["evaluations"])}>Back to the evaluations</a>
      </div>
    </form>
  );
}

function CollectionChoice(props: { collections: Collection[]; name: string; choose: (name: string) => void }) {
  return (
    <Field
      label="Collection"
      hint="Its shapes need labels. Those with a transformation are asked with; if there are none, each in turn."
    >
      {(id) => (
        <select id={id} value={props.name} onChange={(event) => props.choose(event.currentTarget.value)}>
          {props.collections.map((one) => (
            <option key={one.name} value={one.name}>
              {one.name} · {count(one.ready_count, "shape")}
            </option>
          ))}
        </select>
      )}
    </Field>
  );
}

function ModelChoice(props: { models: Model[]; chosen: string[]; choose: (models: string[]) => void }) {
  const { chosen, choose } = props;
  const toggle = (model: string) =>
    choose(chosen.includes(model) ? chosen.filter((one) => one !== model) : [...chosen, model]);
  return (
    <fieldset>
      <legend>Models</legend>
      <div class="choices">
        {props.models.map((model) => (
          <label key={model.name} class="tick">
            <input
              type="checkbox"
              checked={chosen.includes(model.name)}
              disabled={!chosen.includes(model.name) && chosen.length >= MOST_MODELS}
              onChange={() => toggle(model.name)}
            />
            <span>
              {model.name} <small class="quiet">{summary(model)}</small>
            </span>
          </label>
        ))}
      </div>
    </fieldset>
  );
}

function FirstChoice(props: { models: string[]; first: string; choose: (model: string) => void }) {
  return (
    <Field label="Others are compared with" hint="The difference of each model from this one is shown.">
      {(id) => (
        <select id={id} value={props.first} onChange={(event) => props.choose(event.currentTarget.value)}>
          {props.models.map((model) => (
            <option key={model}>{model}</option>
          ))}
        </select>
      )}
    </Field>
  );
}

function DissimilarityChoice(props: { chosen: string; choose: (name: string) => void }) {
  return (
    <Field label="Dissimilarity" hint="Models of more than histograms, like banks, take the first three only.">
      {(id) => (
        <select id={id} value={props.chosen} onChange={(event) => props.choose(event.currentTarget.value)}>
          <option value="">each channel by its own (recommended)</option>
          {DISSIMILARITIES.map(([key, words]) => (
            <option key={key} value={key}>
              {words}
            </option>
          ))}
        </select>
      )}
    </Field>
  );
}
