// One label for many shapes.

import { useEffect, useRef, useState } from "preact/hooks";
import { ask, type Problem } from "../../api/client";
import type { Shape } from "../../api/types";
import { Bar, Dialog, Field, Trouble } from "../../ui/basics";
import { asProblem } from "../../ui/loading";
import { notify } from "../../ui/toasts";
import { count } from "../../ui/words";
import { each } from "./pool";

interface Props {
  shapes: readonly Shape[];
  close: () => void;
  changed: (shape: Shape) => void;
  done: () => void;
}

const AT_ONCE = 4;

export function Relabelling(props: Props) {
  const [shapes] = useState(props.shapes); // those that were selected when it was opened
  const [label, setLabel] = useState(() => common(props.shapes));
  const [done, setDone] = useState<number | null>(null);
  const [problem, setProblem] = useState<Problem | null>(null);
  const isOpen = useRef(true);
  useEffect(() => () => void (isOpen.current = false), []);
  const relabel = async () => {
    setProblem(null);
    setDone(0);
    const failed: unknown[] = [];
    await each(shapes, AT_ONCE, async (shape) => {
      if (!isOpen.current || failed.length > 0) return;
      try {
        const json = { label: label.trim() || null };
        props.changed(await ask<Shape>(`v1/shapes/${shape.id}`, { method: "PATCH", json }));
        setDone((before) => (before ?? 0) + 1);
      } catch (error) {
        failed.push(error);
      }
    });
    if (!isOpen.current) return;
    if (failed.length > 0) {
      setProblem(asProblem(failed[0]));
      setDone(null);
      return;
    }
    notify(
      label.trim()
        ? `${count(shapes.length, "shape")} labelled ${label.trim()}`
        : `${count(shapes.length, "label")} removed`,
    );
    props.done();
    props.close();
  };
  return (
    <Dialog title={`Relabel ${count(shapes.length, "shape")}`} close={props.close}>
      <form
        onSubmit={(event) => {
          event.preventDefault();
          void relabel();
        }}
      >
        <Trouble problem={problem} />
        <Field
          label="Label"
          hint="What all of them are. Left empty, their labels are removed. Nothing is computed again."
        >
          {(id) => (
            <input
              id={id}
              autofocus
              autocomplete="off"
              maxLength={255}
              disabled={done !== null}
              value={label}
              onInput={(event) => setLabel(event.currentTarget.value)}
            />
          )}
        </Field>
        {done === null ? (
          <button type="submit" class="main">
            Relabel
          </button>
        ) : (
          <div class="jobbar">
            <Bar value={done / shapes.length} label="relabelling" />
            <span class="quiet">
              {done} of {shapes.length}; closing this window stops it
            </span>
          </div>
        )}
      </form>
    </Dialog>
  );
}

/** The label that all of them have. */
function common(shapes: readonly Shape[]): string {
  const labels = new Set(shapes.map(({ label }) => label));
  const [only] = labels;
  return labels.size === 1 ? (only ?? "") : "";
}
