// Colours for numbers on surfaces: one scale for all that stands side by side.

/** From low to high for k(x,x), dark to light; from negative over zero to positive otherwise. */
export type Scheme = "sequential" | "diverging";

const SEQUENTIAL = [
  [0.16, 0.1, 0.3],
  [0.15, 0.32, 0.5],
  [0.12, 0.53, 0.54],
  [0.36, 0.73, 0.42],
  [0.97, 0.89, 0.32],
] as const;
const DIVERGING = [
  [0.13, 0.34, 0.66],
  [0.55, 0.72, 0.88],
  [0.94, 0.93, 0.91],
  [0.93, 0.63, 0.5],
  [0.7, 0.14, 0.2],
] as const;

export interface Range {
  low: number;
  high: number;
}

/** Colour at a share of the scale, each part in [0, 1] of sRGB. */
export function colourAt(share: number, scheme: Scheme): [number, number, number] {
  const stops = scheme === "sequential" ? SEQUENTIAL : DIVERGING;
  const place = Math.min(1, Math.max(0, Number.isFinite(share) ? share : 0)) * (stops.length - 1);
  const at = Math.min(stops.length - 2, Math.floor(place));
  const part = place - at;
  return [0, 1, 2].map((i) => stops[at]![i]! * (1 - part) + stops[at + 1]![i]! * part) as [number, number, number];
}

/** What all values span, without the outermost hundredths, which noise would stretch. */
export function rangeOf(fields: readonly Float32Array[], scheme: Scheme): Range {
  const all = fields.flatMap((field) => [...sample(field)]).filter(Number.isFinite).sort((a, b) => a - b);
  if (!all.length) return { low: 0, high: 1 };
  const low = all[Math.floor(0.01 * (all.length - 1))]!;
  const high = all[Math.ceil(0.99 * (all.length - 1))]!;
  if (scheme === "sequential") return { low, high: high > low ? high : low + 1 };
  const reach = Math.max(Math.abs(low), Math.abs(high)) || 1;
  return { low: -reach, high: reach };
}

function* sample(field: Float32Array): Iterable<number> {
  const step = Math.max(1, Math.floor(field.length / 5000));
  for (let i = 0; i < field.length; i += step) yield field[i]!;
}
