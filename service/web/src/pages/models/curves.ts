// K²(λ) of kernels, made comparable.

import { extent } from "d3-array";
import type { KernelCurve, Model } from "../../api/types";
import { unitOf } from "./words";

export interface Curve {
  name: string;
  unit: string;
  points: [number, number][];
  /** Of ln K² on ln λ where it is the same everywhere: such a kernel is the same in every unit. */
  slope: number | null;
}

export const SCALED = "K²(λ), sized to a largest λK² of 1";
const SLOPES: Record<string, number> = { "commute-time": -1, biharmonic: -2 };
const FLOOR = 1e-6; // of a curve's largest value: below, nothing is left to see

/** The only curve of a model of one kernel; null of banks, and of models without a kernel. */
export function singleCurve(model: Model): Curve | null {
  const [curve, ...others] = model.kernels;
  return curve === undefined || others.length > 0 ? null : scaled(model.name, unitOf(model, curve), curve);
}

/**
 * A curve to be laid over others. A kernel's size has no meaning, since distances are compared with each other only;
 * so it is divided by its largest λK², which is what an octave of the spectrum adds to squared distances.
 */
export function scaled(name: string, unit: string, curve: KernelCurve): Curve {
  const { eigenvalues, squared_transfer } = curve;
  const top = Math.max(...eigenvalues.map((eigenvalue, i) => eigenvalue * squared_transfer[i]!));
  const slope = SLOPES[curve.kind] ?? null;
  if (!(top > 0)) return { name, unit, slope, points: [] };
  return { name, unit, slope, points: eigenvalues.map((eigenvalue, i) => [eigenvalue, squared_transfer[i]! / top]) };
}

/** Points of a curve as far down as it is drawn; it ends on the floor, not somewhere above it. */
export function seen(points: readonly [number, number][]): [number, number][] {
  const floor = FLOOR * Math.max(...points.map(([, value]) => value));
  return points.flatMap((point, i): [number, number][] => {
    if (point[1] >= floor) return [point];
    return [points[i - 1], points[i + 1]].flatMap((beside) =>
      beside && beside[1] >= floor && point[1] > 0 ? [crossing(beside, point, floor)] : [],
    );
  });
}

function crossing(above: [number, number], below: [number, number], floor: number): [number, number] {
  const share = Math.log(above[1] / floor) / Math.log(above[1] / below[1]);
  return [Math.exp(Math.log(above[0]) + share * Math.log(below[0] / above[0])), floor];
}

/** A table with a row for each eigenvalue of each curve. */
export function curveRows(curves: readonly Curve[]): (string | number)[][] {
  return [
    ["model", "unit of eigenvalues", "eigenvalue", "squared transfer, largest product with the eigenvalue 1"],
    ...curves.flatMap((curve) => curve.points.map(([x, y]) => [curve.name, curve.unit, x, y])),
  ];
}

/** Curves by the unit of their eigenvalues; those that are the same in every unit are laid over all others. */
export function byUnit(curves: readonly Curve[]): [string, Curve[]][] {
  const bound = curves.filter((curve) => curve.slope === null);
  if (bound.length === 0) return curves.length ? [[curves[0]!.unit, [...curves]]] : [];
  return [...new Set(bound.map((curve) => curve.unit))].map((unit) => {
    const members = bound.filter((curve) => curve.unit === unit);
    const ends = extent(members.flatMap((curve) => curve.points.map(([x]) => x)));
    const shown = curves.filter((curve) => members.includes(curve) || curve.slope !== null);
    return [unit, shown.map((curve) => over(curve, ends))];
  });
}

/** A curve of one slope from end to end: two points, since it is straight on logarithmic axes. Others as they are. */
function over(curve: Curve, ends: [number, number] | [undefined, undefined]): Curve {
  const [low, high] = ends;
  if (low === undefined || curve.slope === null) return curve;
  const slope = curve.slope;
  const top = Math.max(low ** (1 + slope), high ** (1 + slope));
  return { ...curve, points: [low, high].map((x) => [x, x ** slope / top]) };
}
