// Which model an evaluation found to be the best.

import type { Evaluation, Interval } from "../../api/types";

/** By the mean of the rows of the table, or over all queries where there is none; of equals the first. */
export function bestModel(evaluation: Evaluation): { model: string; mean: number } | null {
  const means = meansOf(evaluation);
  let best: { model: string; mean: number } | null = null;
  for (const model of evaluation.models) {
    const mean = means[model]?.value;
    if (mean !== undefined && (best === null || mean > best.mean)) best = { model, mean };
  }
  return best;
}

export function meansOf(evaluation: Evaluation): Record<string, Interval> {
  return hasTable(evaluation) ? evaluation.mean_of_rows : evaluation.mean_intervals;
}

export function hasTable(evaluation: Evaluation): boolean {
  return Object.keys(evaluation.table).length > 0;
}
