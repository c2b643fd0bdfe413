// The viewer as a part of a page: canvas, keys, and buttons below.

import type { ComponentChildren } from "preact";
import { useEffect, useRef, useState } from "preact/hooks";
import { fetchBytes, type Problem } from "../api/client";
import { Trouble } from "../ui/basics";
import { asProblem } from "../ui/loading";
import { save } from "../plots/save";
import { colourAt, type Range, type Scheme } from "./colours";
import type { Stage } from "./stage";

/** A number at each vertex, to be painted. */
export interface Field {
  values: Float32Array;
  range: Range;
  scheme: Scheme;
}

interface Props {
  /** Path of a GLB file in the API, or the file itself. */
  mesh: string | ArrayBuffer;
  name: string;
  field?: Field | null;
  wireframe?: boolean;
  /** Told the stage once the mesh is on it, null when it goes. */
  ready?: (stage: Stage | null) => void;
  children?: ComponentChildren;
}

const STEP = Math.PI / 18;
const KEYS: Record<string, [number, number, number]> = {
  ArrowLeft: [-STEP, 0, 1],
  ArrowRight: [STEP, 0, 1],
  ArrowUp: [0, STEP, 1],
  ArrowDown: [0, -STEP, 1],
  "+": [0, 0, 0.85],
  "=": [0, 0, 0.85],
  "-": [0, 0, 1 / 0.85],
};

/** A mesh that can be turned with mouse, fingers or arrow keys. */
export function Viewer(props: Props) {
  const canvas = useRef<HTMLCanvasElement>(null);
  const stage = useRef<Stage | null>(null);
  const [isThere, setThere] = useState(false);
  const [problem, setProblem] = useState<Problem | null>(null);

  useEffect(() => {
    const abort = new AbortController();
    setThere(false);
    setProblem(null);
    (async () => {
      const bytes = typeof props.mesh === "string" ? fetchBytes(props.mesh, abort.signal) : props.mesh;
      const [{ Stage }, glb] = await Promise.all([import("./stage"), bytes]);
      if (abort.signal.aborted || !canvas.current) return;
      stage.current ??= new Stage(canvas.current);
      await stage.current.load(glb);
      if (abort.signal.aborted) return;
      setThere(true);
      props.ready?.(stage.current);
    })().catch((error: unknown) => !abort.signal.aborted && setProblem(asProblem(error)));
    return () => abort.abort();
  }, [props.mesh]);

  useEffect(
    () => () => {
      props.ready?.(null);
      stage.current?.dispose();
      stage.current = null;
    },
    [],
  );

  useEffect(() => {
    if (!isThere) return;
    const { field } = props;
    stage.current?.paint(field?.values ?? null, field?.range ?? { low: 0, high: 1 }, field?.scheme ?? "sequential");
  }, [isThere, props.field]);

  useEffect(() => {
    if (isThere && stage.current) stage.current.wireframe = props.wireframe ?? false;
  }, [isThere, props.wireframe]);

  const turn = (event: KeyboardEvent) => {
    const step = KEYS[event.key];
    if (!step) return;
    event.preventDefault();
    stage.current?.turn(...step);
  };
  return (
    <figure class="viewer">
      <div class="view">
        <canvas
          ref={canvas}
          tabIndex={0}
          role="img"
          aria-label={`${props.name} in three dimensions; arrow keys turn it, plus and minus bring it closer`}
          onKeyDown={turn}
          data-ready={isThere}
        />
        {!isThere && problem === null && <span class="loading">Loading the mesh…</span>}
        <Trouble problem={problem} />
      </div>
      <figcaption>
        <span class="viewname">{props.name}</span>
        {props.children}
        <button type="button" class="plain small" onClick={() => stage.current?.reset()}>
          Reset view
        </button>
        <button
          type="button"
          class="plain small"
          onClick={async () => {
            const picture = await stage.current?.picture();
            if (picture) save(picture, `${props.name.replace(/\.\w+$/, "")}.png`);
          }}
        >
          Save picture
        </button>
      </figcaption>
    </figure>
  );
}

/** The scale of a painted field, with numbers. */
export function Legend(props: { range: Range; scheme: Scheme; label: string; format: (value: number) => string }) {
  const stops = Array.from({ length: 48 }, (_, i) => colourAt(i / 47, props.scheme));
  return (
    <div class="scale">
      <span>{props.label}</span>
      <span class="numbers">{props.format(props.range.low)}</span>
      <svg viewBox="0 0 48 4" preserveAspectRatio="none" aria-hidden="true">
        {stops.map((colour, i) => (
          <rect key={i} x={i} width={1.05} height={4} fill={`rgb(${colour.map((part) => Math.round(255 * part)).join()})`} />
        ))}
      </svg>
      <span class="numbers">{props.format(props.range.high)}</span>
    </div>
  );
}
