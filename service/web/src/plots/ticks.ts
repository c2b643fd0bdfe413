// Where the lines of an axis are, and what is written at them.

import { brief } from "../ui/words";

const RAISED = "⁰¹²³⁴⁵⁶⁷⁸⁹";
const ROUND = [1, 2, 5];

interface Ticking {
  ticks: (count?: number) => number[];
}

/** Round numbers on an axis; on a logarithmic one powers of ten, where it spans at least two of them. */
export function ticksOf(scale: Ticking, log: boolean, wanted: number): number[] {
  const ticks = scale.ticks(wanted);
  if (!log || ticks.length <= wanted) return ticks;
  const powers = ticks.filter((tick) => mantissa(tick) === 1);
  if (powers.length >= 3) return powers;
  const round = ticks.filter((tick) => ROUND.includes(mantissa(tick)));
  return round.length >= 2 ? round : ticks;
}

/** What is written at a tick: powers of ten that are far from 1 as such. */
export function tickName(tick: number, log: boolean): string {
  if (!log || mantissa(tick) !== 1) return brief(tick);
  const exponent = Math.round(Math.log10(tick));
  if (Math.abs(exponent) <= 2) return brief(tick);
  const digits = [...String(Math.abs(exponent))].map((digit) => RAISED[Number(digit)]).join("");
  return `10${exponent < 0 ? "⁻" : ""}${digits}`;
}

/** 3 of 0.003. */
function mantissa(value: number): number {
  const power = 10 ** Math.floor(Math.log10(value) + 1e-9);
  return Number((value / power).toPrecision(6));
}
