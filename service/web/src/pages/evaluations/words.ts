// Measures, dissimilarities and reasons, in words.

import type { Interval, Measures } from "../../api/types";

export interface Measure {
  key: keyof Measures;
  short: string;
  name: string;
  says: string;
}

export const MEASURES: Measure[] = [
  { key: "nearest_neighbour", short: "NN", name: "Nearest neighbour", says: "how often the first one found is right" },
  { key: "first_tier", short: "FT", name: "First tier", says: "right ones among the first n, of n that there are" },
  { key: "second_tier", short: "ST", name: "Second tier", says: "right ones among the first 2n, of n that there are" },
  { key: "e_measure", short: "E", name: "E-measure", says: "precision and recall of the first 32 together" },
  { key: "dcg", short: "DCG", name: "Discounted cumulative gain", says: "right ones count less the later they come" },
  { key: "map", short: "mAP", name: "Mean average precision", says: "precision at each right one, averaged" },
];

/** Instead of each channel's own; the first three compare anything, the others histograms only. */
export const DISSIMILARITIES: [string, string][] = [
  ["l1", "L1: sum of differences"],
  ["l2", "L2: root of squared differences"],
  ["linf", "L∞: largest difference"],
  ["normalised-l1", "L1, by the sizes of both"],
  ["normalised-l2", "L2, by the sizes of both"],
  ["kullback-leibler", "Kullback-Leibler"],
  ["jensen-shannon", "Jensen-Shannon"],
  ["bhattacharyya", "Bhattacharyya"],
  ["hellinger", "Hellinger"],
  ["chi-squared", "Chi-squared"],
  ["earth-movers", "Earth mover's"],
  ["kolmogorov-smirnov", "Kolmogorov-Smirnov"],
];

export const REASONS: Record<string, string> = {
  failed: "could not be computed",
  "no-label": "without a label, so that nothing can be right or wrong",
  "no-relevant-target": "of a label that no other shape has",
  "not-described": "not described under every model, or deleted",
};

/** "88.1 (77.4 to 96.2)". */
export function withInterval(its: Interval, sign = false): string {
  return [figure(its.value, sign), bounds(its, sign)].filter(Boolean).join(" ");
}

/** "(77.4 to 96.2)"; nothing where all queries are of one label. */
export function bounds(its: Interval, sign = false): string {
  return its.low === null || its.high === null ? "" : `(${figure(its.low, sign)} to ${figure(its.high, sign)})`;
}

export function figure(value: number, sign = false): string {
  const text = value.toFixed(1).replace("-", "−");
  return sign && value >= 0 ? `+${text}` : text;
}
