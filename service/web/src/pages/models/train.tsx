// The form in which a model is made: its method, what it learns from, and what it should see through.

import { useState } from "preact/hooks";
import { ask, type Problem } from "../../api/client";
import type { Model } from "../../api/types";
import { go, linkTo } from "../../router";
import { Field, Heading, Trouble } from "../../ui/basics";
import { asProblem } from "../../ui/loading";
import { bodyOf, EMPTY, estimate, isComplete, isOrdered, learns, type Draft } from "./draft";
import { useCollections } from "./load";
import { OriginChoice } from "./origin";
import { Parameters } from "./parameters";
import { reveal } from "./remove";
import { StrengthChoice, TransformationChoice } from "./transformations";
import { METHODS } from "./words";

export function TrainPage() {
  const collections = useCollections();
  const [written, setDraft] = useState<Draft>(EMPTY);
  const usual = collections.value?.find((collection) => collection.ready_count > 0)?.name ?? "";
  const draft = { ...written, collection: written.collection || usual };
  const [problem, setProblem] = useState<Problem | null>(null);
  const [isSending, setSending] = useState(false);
  const set = (change: Partial<Draft>) => setDraft((before) => ({ ...before, ...change }));
  const work = estimate(draft, collections.value ?? []);
  const send = async () => {
    setSending(true);
    setProblem(null);
    try {
      const made = await ask<{ model: Model }>("v1/models", { json: bodyOf(draft) });
      reveal(made.model.name);
      go(linkTo(["models", made.model.name]));
    } catch (error) {
      setProblem(asProblem(error));
      setSending(false);
    }
  };
  return (
    <>
      <Heading
        title="Train a model"
        hint={
          <>
            <a href={linkTo(["models"])}>Models</a> · What is learned here can be used for any collection.
          </>
        }
      />
      <form
        class="train"
        onSubmit={(event) => {
          event.preventDefault();
          void send();
        }}
      >
        <NameField name={draft.name} set={(name) => set({ name })} />
        <MethodChoice method={draft.method} set={(method) => set({ method })} />
        <Trouble problem={collections.problem} again={collections.again} />
        {learns(draft) && (
          <section class="panel">
            <OriginChoice draft={draft} set={set} collections={collections.value} />
            {!isOrdered(draft) && (
              <>
                <TransformationChoice
                  chosen={draft.transformations}
                  choose={(transformations) => set({ transformations })}
                />
                <StrengthChoice chosen={draft.strengths} choose={(strengths) => set({ strengths })} />
              </>
            )}
          </section>
        )}
        <section class="panel">
          <Parameters method={draft.method} values={draft.values} set={(values) => set({ values })} />
          {learns(draft) && <Seed seed={draft.seed} set={(seed) => set({ seed })} />}
        </section>
        <div class="send">
          {work && (
            <p role="status" class={work.isTooMuch ? "toomuch" : undefined}>
              {work.text}
            </p>
          )}
          <Trouble problem={problem} />
          <div class="row">
            <button type="submit" class="main" disabled={isSending || !isComplete(draft)}>
              {isSending ? "Sending…" : learns(draft) ? "Train it" : "Make it"}
            </button>
            <a href={linkTo(["models"])}>Back to the models</a>
          </div>
        </div>
      </form>
    </>
  );
}

function NameField(props: { name: string; set: (name: string) => void }) {
  return (
    <section class="panel">
      <Field label="Name" hint="Small letters, digits, - and _; a letter or digit first. For instance: zoo-noise.">
        {(id) => (
          <input
            id={id}
            required
            pattern="[a-z0-9][a-z0-9_\-]*"
            maxLength={63}
            title="small letters, digits, - and _, beginning with a letter or digit"
            autocomplete="off"
            spellcheck={false}
            value={props.name}
            onInput={(event) => props.set(event.currentTarget.value)}
          />
        )}
      </Field>
    </section>
  );
}

function MethodChoice(props: { method: string; set: (method: string) => void }) {
  const groups: [string, boolean][] = [
    ["Learned from shapes", true],
    ["With nothing to learn, ready at once", false],
  ];
  return (
    <section class="panel">
      <fieldset>
        <legend>Method</legend>
        {groups.map(([title, learned]) => (
          <div key={title}>
            <p class="quiet">{title}</p>
            <div class="methods">
              {Object.entries(METHODS)
                .filter(([, method]) => method.learns === learned)
                .map(([key, method]) => (
                  <label key={key} class={`card${props.method === key ? " chosen" : ""}`}>
                    <span class="tick">
                      <input
                        type="radio"
                        name="method"
                        checked={props.method === key}
                        onChange={() => props.set(key)}
                      />
                      <strong>{method.name}</strong>
                    </span>
                    <small class="quiet">{method.says}</small>
                  </label>
                ))}
            </div>
          </div>
        ))}
      </fieldset>
    </section>
  );
}

function Seed(props: { seed: string; set: (seed: string) => void }) {
  return (
    <details>
      <summary>Chance</summary>
      <Field label="Seed" hint="The same seed gives the same model; another one simulates other deformations.">
        {(id) => (
          <input
            id={id}
            type="number"
            min={0}
            max={2 ** 31 - 1}
            step={1}
            placeholder="0"
            value={props.seed}
            onInput={(event) => props.set(event.currentTarget.value)}
          />
        )}
      </Field>
    </details>
  );
}
