// k(x,x) as colours: of one kernel, on one or several shapes, on one scale.

import { useMemo } from "preact/hooks";
import { ask, fetchBytes } from "../api/client";
import type { Spectrum } from "../api/types";
import { Field } from "../ui/basics";
import { useLoad } from "../ui/loading";
import { brief } from "../ui/words";
import { rangeOf, type Range } from "./colours";
import type { Field as Painted } from "./viewer";

/** A kernel of which k(x,x) is painted. */
export type PaintedKernel = { kind: "heat"; time: number } | { kind: "commute-time" | "biharmonic" };

const LEAST_TIME = 0.005;
const MOST_TIME = 2;
const FIRST_TIME = 0.15;

export function nameOf(kernel: PaintedKernel): string {
  return kernel.kind === "heat" ? `heat:${Number(kernel.time.toPrecision(3))}` : kernel.kind;
}

export interface Signatures {
  fields: Painted[] | null;
  range: Range;
  format: (logarithm: number) => string;
}

/**
 * ln(A k(x,x)) at every vertex of the shapes or queries at these places of the API: without a
 * unit, so that shapes of different scale have the same colours.
 */
export function useSignatures(places: string[], kernel: PaintedKernel | null): Signatures {
  const name = kernel && nameOf(kernel);
  const found = useLoad(
    async (signal) => (name === null ? null : Promise.all(places.map((place) => signature(place, name, signal)))),
    [...places, name],
  );
  const isCurrent = name !== null && found.value !== null;
  const painted = useMemo(() => {
    if (found.value === null) return null;
    const range = rangeOf(found.value, "sequential");
    return { range, fields: found.value.map((values) => ({ values, range, scheme: "sequential" as const })) };
  }, [found.value]);
  return {
    fields: isCurrent ? (painted?.fields ?? null) : null,
    range: painted?.range ?? { low: 0, high: 1 },
    format: (logarithm) => brief(Math.exp(logarithm)),
  };
}

async function signature(place: string, kernel: string, signal: AbortSignal): Promise<Float32Array> {
  const [bytes, spectrum] = await Promise.all([
    fetchBytes(`${place}/signature?kernel=${encodeURIComponent(kernel)}`, signal),
    ask<Spectrum>(`${place}/spectrum`, { signal }),
  ]);
  return floats(bytes).map((value) => Math.log(Math.max(value * spectrum.area, 1e-12)));
}

/** Little-endian numbers, whatever the machine. */
export function floats(bytes: ArrayBuffer): Float32Array {
  const view = new DataView(bytes);
  return Float32Array.from({ length: bytes.byteLength / 4 }, (_, i) => view.getFloat32(4 * i, true));
}

/** Which kernel is painted: none, one of several, heat with a slider over its time. */
export function KernelChoice(props: { chosen: PaintedKernel | null; choose: (kernel: PaintedKernel | null) => void }) {
  const { chosen, choose } = props;
  const pick = (kind: string) => {
    if (kind === "heat") choose({ kind, time: FIRST_TIME });
    else choose(kind === "commute-time" || kind === "biharmonic" ? { kind } : null);
  };
  return (
    <div class="row">
      <Field label="Colours">
        {(id) => (
          <select id={id} value={chosen?.kind ?? ""} onChange={(event) => pick(event.currentTarget.value)}>
            <option value="">none</option>
            <option value="heat">k(x,x) of heat</option>
            <option value="commute-time">k(x,x) of commute time</option>
            <option value="biharmonic">k(x,x) of the biharmonic kernel</option>
          </select>
        )}
      </Field>
      {chosen?.kind === "heat" && (
        <Field label={`Time ${brief(chosen.time)}/λ₁`}>
          {(id) => (
            <input
              id={id}
              type="range"
              min={Math.log(LEAST_TIME)}
              max={Math.log(MOST_TIME)}
              step={0.05}
              value={Math.log(chosen.time)}
              onChange={(event) => choose({ kind: "heat", time: Math.exp(Number(event.currentTarget.value)) })}
            />
          )}
        </Field>
      )}
    </div>
  );
}
