// What models are made of, in words.

import type { Channel, Json, KernelCurve, Model } from "../../api/types";
import { brief, grouped } from "../../ui/words";

export interface Method {
  name: string;
  says: string;
  learns: boolean;
}

export const METHODS: Record<string, Method> = {
  bank: {
    name: "Bank of channels",
    says: "Many kernels, weighted so that a deformed copy finds its own shape first. The best; recommended.",
    learns: true,
  },
  spline: {
    name: "Learned kernel, in splines",
    says: "One kernel: K²(λ) is a smooth curve that transformations change least (eq. 13 of the paper).",
    learns: true,
  },
  grid: {
    name: "Learned kernel, on a grid",
    says: "One kernel: K²(λ) is found point by point (eq. 10 of the paper).",
    learns: true,
  },
  "heat-time": {
    name: "Heat kernel at its best time",
    says: "The heat kernel; only its time is learned.",
    learns: true,
  },
  heat: { name: "Heat kernel", says: "Distances by heat that has spread for a time that you choose.", learns: false },
  "commute-time": {
    name: "Commute-time kernel",
    says: "Distances by how long a random walk takes there and back.",
    learns: false,
  },
  biharmonic: { name: "Biharmonic kernel", says: "Like commute time, but smoother near a point.", learns: false },
  "shape-dna": { name: "Shape-DNA", says: "The first eigenvalues themselves, without distances.", learns: false },
};
export const BUILT_IN: ReadonlySet<string> = new Set(["proteus", "heat", "commute-time", "biharmonic", "shape-dna"]);

export function methodName(method: string): string {
  return METHODS[method]?.name ?? method;
}

/** What a model is, in one line. */
export function summary(model: Pick<Model, "method" | "channels">): string {
  const { length } = model.channels;
  return model.method === "bank" && length > 0 ? `Bank of ${length} channels` : methodName(model.method);
}

const UNITS: Record<string, string> = {
  none: "as the meshes are",
  area: "surface area 1",
  "first-eigenvalue": "first eigenvalue 1",
  mean: "divided by the mean",
};

/** To which size shapes are brought before a channel looks at them. */
export function unitName(normalisation: string): string {
  return UNITS[normalisation] ?? normalisation;
}

/** What stands on the axis of λ. */
export function eigenvalueLabel(normalisation: string): string {
  if (normalisation === "first-eigenvalue") return "λ in units of the first eigenvalue";
  if (normalisation === "area") return "λ at surface area 1";
  return "λ in 1/area of the meshes' own unit";
}

function timeIn(time: Json | undefined, normalisation: string): string {
  const value = typeof time === "number" ? String(Number(time.toPrecision(3))) : "?";
  if (normalisation === "first-eigenvalue") return `${value}/λ₁`;
  return normalisation === "area" ? `${value} of the area` : value;
}

const KERNELS: Record<string, (parameters: Record<string, Json>, unit: string) => string> = {
  heat: ({ time }, unit) => `heat, time ${timeIn(time, unit)}`,
  "mexican-hat": ({ time }, unit) => `Mexican hat, time ${timeIn(time, unit)}`,
  wave: ({ energy, width }, unit) =>
    `wave, ln ${unit === "first-eigenvalue" ? "λ/λ₁" : "λ"} near ${String(energy)}, width ${String(width)}`,
  "commute-time": () => "commute time",
  biharmonic: () => "biharmonic",
  spline: () => "learned, in splines",
  tabulated: () => "learned, on a grid",
};

/** A channel's kernel, whose form the OpenAPI document leaves open. */
interface Kernel {
  kind: string;
  parameters: Record<string, Json>;
}

/** A channel's kernel and its time. */
export function kernelName(channel: Pick<Channel, "kernel" | "normalisation">): string {
  if (channel.kernel === null) return "none";
  const { kind, parameters } = channel.kernel as unknown as Kernel;
  return KERNELS[kind]?.(parameters, channel.normalisation) ?? kind;
}

/** Fields of a channel beyond the contract. */
interface Details {
  samples?: number;
  centre?: string;
}

/** What a channel takes of a shape. */
export function featureName(channel: Channel & Details): string {
  const { feature, levels, samples, centre } = channel;
  switch (feature) {
    case "distance-distribution":
      return `histogram of the distances between ${samples ?? "sampled"} points`;
    case "diagonal-distribution":
      return "distribution of k(x,x) over the surface";
    case "log-diagonal-distribution":
      return `distribution of ln k(x,x)${centre && centre !== "none" ? ", less its mean" : ""}`;
    case "log-diagonal-points":
      return `ln k(x,x) at ${samples ?? "sampled"} points and ${levels?.length ?? "several"} times`;
    case "eigenvalues":
      return levels?.length ? `eigenvalues ${levels[0]} to ${levels.at(-1)}, as logarithms` : "eigenvalues";
    case "area":
      return "logarithm of the surface's area";
    case "roughness":
      return levels?.length
        ? `how rough a query is: from ${levels[0]} on its view counts less, from ${levels.at(-1)} on not at all`
        : "how rough a query is";
    default:
      return feature;
  }
}

const STEPS: Record<string, (parameters: Record<string, number>) => string> = {
  "cap-holes": ({ longest }) =>
    `close holes with caps, where the squared length of the rim is at most ${longest} times the area`,
  double: ({ longest }) =>
    `give a sheet a back, where the squared length of its rim is more than ${longest} times the area`,
  fair: ({ time }) => `average noise along the mesh's graph (time ${time} of the area)`,
  refine: ({ vertices = 0 }) => `refine a mesh of fewer than ${grouped(vertices)} vertices`,
  simplify: ({ vertices = 0 }) => `simplify a mesh of more than ${grouped(vertices)} vertices`,
  smooth: ({ time, steps }) => `smooth by curvature flow, ${steps} steps of ${time} of the area each`,
};

export function stepName(step: { name: string; parameters: Record<string, number> }): string {
  const known = STEPS[step.name]?.(step.parameters);
  if (known) return known;
  const given = Object.entries(step.parameters).map(([name, value]) => `${name} ${brief(value)}`);
  return [step.name, ...given].join(", ");
}

export function fusionSentence(power: number, channels: number): string {
  if (channels === 1) return "The model has one channel: its dissimilarity is the distance of two shapes.";
  const times = brief(16 ** power);
  return (
    `The distance of two shapes is the sum over all channels of weight × (dissimilarity ÷ scale) to the power ` +
    `${brief(power)}. ` +
    (power < 1
      ? `A channel that finds sixteen times the difference counts ${times} times as much, so that one which fails ` +
        "does not drown the others."
      : "Every channel counts in proportion to the difference that it finds.")
  );
}

/** The unit of a curve's λ: that of the channel it belongs to. */
export function unitOf(model: Pick<Model, "channels">, curve: KernelCurve): string {
  return model.channels.find((channel) => channel.name === curve.name)?.normalisation ?? "none";
}
