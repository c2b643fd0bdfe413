// Small parts that every page is made of.

import type { ComponentChildren, JSX } from "preact";
import { useEffect, useId, useRef, useState } from "preact/hooks";
import { fetchBytes, hasKey, urlOf, type Problem } from "../api/client";
import type { Job, Shape } from "../api/types";
import { standOf } from "./steps";
import { share } from "./words";

/** A page's head: its title, a line below it, and what can be done on the right. */
export function Heading(props: { title: ComponentChildren; hint?: ComponentChildren; children?: ComponentChildren }) {
  return (
    <header class="heading">
      <div>
        <h1>{props.title}</h1>
        {props.hint && <p class="quiet">{props.hint}</p>}
      </div>
      {props.children && <div class="actions">{props.children}</div>}
    </header>
  );
}

/** What went wrong, in words, and what to do about it. */
export function Trouble(props: { problem: Problem | null; again?: () => void }) {
  const { problem, again } = props;
  if (problem === null) return null;
  return (
    <div class="trouble" role="alert">
      <strong>{problem.title}</strong>
      {problem.detail && problem.detail !== problem.title && <p>{sentence(problem.detail)}</p>}
      {again && (
        <button type="button" onClick={again}>
          Try again
        </button>
      )}
    </div>
  );
}

/** Nothing is here yet: what would be, and how to get it. */
export function Empty(props: { title: string; children?: ComponentChildren }) {
  return (
    <div class="empty">
      <h2>{props.title}</h2>
      {props.children}
    </div>
  );
}

/** How far something is; without `value` that it goes on. */
export function Bar(props: { value: number | null; label: string }) {
  const known = props.value !== null;
  return (
    <progress
      class={known ? "bar" : "bar endless"}
      aria-label={props.label}
      max={1}
      {...(known ? { value: props.value as number } : {})}
    />
  );
}

/** A job's bar with what it is at. */
export function JobBar(props: { job: Job; label?: string }) {
  const { done, total } = props.job.progress;
  const waits = props.job.state === "queued";
  return (
    <div class="jobbar">
      <Bar value={waits || total === 0 ? null : done / total} label={props.label ?? "progress"} />
      <span class="quiet">{standOf(props.job)}</span>
    </div>
  );
}

/** A word with a colour and a sign, for a state. */
export function Badge(props: { state: string; children?: ComponentChildren }) {
  return <span class={`badge is-${props.state}`}>{props.children ?? props.state}</span>;
}

/** How alike, as a number and a bar. */
export function Similarity(props: { value: number }) {
  return (
    <span class="similarity" title="Similarity: 100 % is an equal descriptor">
      <meter min={0} max={1} value={props.value} aria-label="similarity" />
      <span>{share(props.value)}</span>
    </span>
  );
}

/** A shape's picture; where keys are asked for, it is fetched with ours. */
export function Thumbnail(props: { shape: Pick<Shape, "id" | "name" | "state">; size?: number }) {
  const { shape, size = 128 } = props;
  const path = `v1/shapes/${shape.id}/thumbnail.png`;
  const source = usePicture(shape.state === "ready" ? path : null);
  if (source === null) return <span class="nopicture" aria-hidden="true" style={{ width: `${size}px`, height: `${size}px` }} />;
  return <img class="thumbnail" src={source} alt={`picture of ${shape.name}`} width={size} height={size} loading="lazy" />;
}

function usePicture(path: string | null): string | null {
  const withKey = hasKey();
  const [source, setSource] = useState<string | null>(null);
  useEffect(() => {
    if (path === null || !withKey) return;
    const abort = new AbortController();
    let made = "";
    fetchBytes(path, abort.signal)
      .then((bytes) => {
        made = URL.createObjectURL(new Blob([bytes], { type: "image/png" }));
        setSource(made);
      })
      .catch(() => setSource(null));
    return () => {
      abort.abort();
      if (made) URL.revokeObjectURL(made);
    };
  }, [path, withKey]);
  if (path === null) return null;
  return withKey ? source : urlOf(path);
}

/** A name above its control. */
export function Field(props: { label: string; hint?: ComponentChildren; children: (id: string) => JSX.Element }) {
  const id = useId();
  return (
    <div class="field">
      <label for={id}>{props.label}</label>
      {props.children(id)}
      {props.hint && <small class="quiet">{props.hint}</small>}
    </div>
  );
}

/** A window over the page; Escape and a click beside it close it. */
export function Dialog(props: { title: string; close: () => void; children: ComponentChildren; wide?: boolean }) {
  const box = useRef<HTMLDialogElement>(null);
  const title = useId();
  useEffect(() => box.current?.showModal(), []);
  return (
    <dialog
      ref={box}
      class={props.wide ? "wide" : ""}
      aria-labelledby={title}
      onClose={props.close}
      onClick={(event) => event.target === box.current && box.current?.close()}
    >
      <div class="dialog">
        <header>
          <h2 id={title}>{props.title}</h2>
          <button type="button" class="plain" aria-label="Close" onClick={() => box.current?.close()}>
            ✕
          </button>
        </header>
        {props.children}
      </div>
    </dialog>
  );
}

/** Words of the service as a sentence of ours. */
export function sentence(text: string): string {
  const trimmed = text.trim();
  if (!trimmed) return "";
  const begun = trimmed[0]!.toUpperCase() + trimmed.slice(1);
  return /[.!?]$/.test(begun) ? begun : `${begun}.`;
}
