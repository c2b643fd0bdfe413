// "Use it for…": a collection moves to a model, and can go back to the one it had.

import { signal } from "@preact/signals";
import { useEffect, useState } from "preact/hooks";
import { ask } from "../../api/client";
import { hasEnded, watchJob } from "../../api/jobs";
import type { Collection, Job } from "../../api/types";
import { linkTo } from "../../router";
import { Dialog, Field, JobBar } from "../../ui/basics";
import { notify, notifyProblem } from "../../ui/toasts";
import { count } from "../../ui/words";
import { ErrorList } from "./source";

/** A collection on its way to a model, or there: it goes on while other pages are looked at. */
interface Move {
  collection: string;
  model: string;
  before: string;
  job: Job;
}

const moves = signal<readonly Move[]>([]);

function update(move: Move): void {
  moves.value = [...moves.value.filter((other) => other.job.id !== move.job.id), move];
}

/** Begin a move and follow it to its end; a failure is shown. */
async function move(collection: string, model: string, before: string): Promise<void> {
  try {
    const path = `v1/collections/${encodeURIComponent(collection)}/model`;
    const { job } = await ask<{ job: Job }>(path, { method: "PUT", json: { model } });
    const tellOf = (newest: Job) => update({ collection, model, before, job: newest });
    moves.value = moves.value.filter((other) => other.collection !== collection);
    tellOf(job);
    const last = await watchJob(job.id, tellOf, new AbortController().signal);
    if (last.state !== "succeeded") return;
    const back = { name: `Go back to ${before}`, act: () => void move(collection, before, model) };
    notify(`${collection} is searched under ${model}`, before === model ? null : back);
  } catch (error) {
    notifyProblem(error);
  }
}

/** Which collection is to be searched under a model; null while they are loaded. */
export function UseDialog(props: { model: string; collections: Collection[] | null; close: () => void }) {
  const { model, close, collections } = props;
  const others = (collections ?? []).filter((collection) => collection.model !== model);
  const [name, setName] = useState("");
  const chosen = others.find((collection) => collection.name === name) ?? others[0];
  const title = `Use ${model} for a collection`;
  if (others.length === 0) {
    return (
      <Dialog title={title} close={close}>
        <p>
          {collections === null && "Loading… "}
          {collections?.length === 0 && "There are no collections yet. "}
          {collections !== null && collections.length > 0 && "Every collection is searched under it. "}
          <a href={linkTo(["collections"])}>Go to the collections</a>
        </p>
      </Dialog>
    );
  }
  return (
    <Dialog title={title} close={close}>
      <form
        onSubmit={(event) => {
          event.preventDefault();
          if (chosen) void move(chosen.name, model, chosen.model);
          close();
        }}
      >
        <Field label="Collection">
          {(id) => (
            <select id={id} value={chosen?.name} onChange={(event) => setName(event.currentTarget.value)}>
              {others.map((collection) => (
                <option key={collection.name} value={collection.name}>
                  {collection.name}, now under {collection.model}
                </option>
              ))}
            </select>
          )}
        </Field>
        <p>
          {count(chosen?.shape_count ?? 0, "shape")} will be described under {model}, from what is stored of them. Until
          that is done, searches go on under {chosen?.model}.
        </p>
        <button type="submit" class="main">
          Use it
        </button>
      </form>
    </Dialog>
  );
}

/** Collections that go to a model, or went there while this page was open. */
export function Moves(props: { model: string; moved: () => void }) {
  const shown = moves.value.filter((one) => one.model === props.model || one.before === props.model);
  const ended = shown.filter((one) => hasEnded(one.job)).map((one) => one.job.id).join();
  useEffect(props.moved, [ended]);
  return (
    <>
      {shown.map((one) => (
        <MoveRow key={one.job.id} move={one} />
      ))}
    </>
  );
}

function MoveRow(props: { move: Move }) {
  const { collection, model, before, job } = props.move;
  const link = <a href={linkTo(["collections", collection])}>{collection}</a>;
  if (!hasEnded(job)) {
    return (
      <div class="panel" role="status">
        <p>
          {link} moves from {before} to {model}. It is searched under {before} meanwhile.
        </p>
        <JobBar job={job} label={`${collection} moves to ${model}`} />
      </div>
    );
  }
  const isThere = job.state === "succeeded";
  return (
    <div class="panel" role="status">
      <div class="row">
        <span>
          {link}{" "}
          {isThere ? `is searched under ${model}.` : `stays under ${before}: the move to ${model} did not end well.`}
        </span>
        {isThere && before !== model && (
          <button type="button" class="small" onClick={() => void move(collection, before, model)}>
            Go back to {before}
          </button>
        )}
        {!isThere && (
          <button type="button" class="small" onClick={() => void move(collection, model, before)}>
            Try again
          </button>
        )}
      </div>
      {job.errors.length > 0 && <ErrorList errors={job.errors} />}
    </div>
  );
}
