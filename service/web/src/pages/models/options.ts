// The parameters of each method, with their effect and their default.

import type { Json } from "../../api/types";

export type Values = Record<string, string>;

export interface Parameter {
  name: string;
  label: string;
  says: string;
  kind: "number" | "choice" | "several" | "switch";
  /** The default; of several choices with commas. */
  usual: string;
  choices?: Record<string, string>;
  limits?: { min: number; max: number; step: number | "any" };
  isAdvanced?: boolean;
}

const VIEWS = {
  detailed: "detailed: holes get caps, twice as many eigenfunctions",
  smooth: "smooth: noise is taken off, holes get caps",
  closed: "closed: holes get caps",
  open: "open: holes stay",
  "smooth-open": "smooth and open",
};
const UNITS = {
  "first-eigenvalue": "first eigenvalue 1: size is forgotten",
  area: "surface area 1: size is forgotten",
  none: "as the meshes are: size counts",
};
const VIEW: Parameter = {
  name: "view",
  label: "How shapes are prepared",
  says: "Holes change distances much; with caps they do so less.",
  kind: "choice",
  usual: "closed",
  choices: { closed: VIEWS.closed, open: VIEWS.open },
};

function unit(usual: string, isAdvanced = false): Parameter {
  const says = "To which size shapes are brought before they are looked at.";
  return { name: "unit", label: "Size of shapes", says, kind: "choice", usual, choices: UNITS, isAdvanced };
}

const LEARNED: Parameter[] = [
  VIEW,
  { ...unit("first-eigenvalue"), isAdvanced: true },
  {
    name: "criterion",
    label: "What should change least",
    says: "Distances found shapes again better than the kernel itself in our studies.",
    kind: "choice",
    usual: "distance",
    choices: { distance: "squared distances d²(x,x′)", kernel: "the kernel k(x,x′), as in the paper" },
    isAdvanced: true,
  },
  {
    name: "margin",
    label: "How far K² goes on",
    says: "By this factor beyond the eigenvalues learned from, it stays constant; farther out there is none.",
    kind: "number",
    usual: "4",
    limits: { min: 1, max: 100, step: "any" },
    isAdvanced: true,
  },
];

export const PARAMETERS: Record<string, Parameter[]> = {
  bank: [
    {
      name: "views",
      label: "Views",
      says: "In each of them every channel is tried; one that nothing needs is dropped.",
      kind: "several",
      usual: "detailed,smooth",
      choices: VIEWS,
    },
    {
      name: "channels",
      label: "Channels at most",
      says: "More are surer on shapes unlike those learned from; fewer are quicker.",
      kind: "number",
      usual: "100",
      limits: { min: 4, max: 200, step: 1 },
    },
    {
      name: "power",
      label: "Power of the fusion",
      says: "Small: a channel that fails does not drown the others. At most 1.",
      kind: "number",
      usual: "0.25",
      limits: { min: 0.01, max: 1, step: "any" },
      isAdvanced: true,
    },
  ],
  spline: [
    {
      name: "splines",
      label: "Splines",
      says: "How finely K² can bend. Left out, about ten; more learn the training's noise.",
      kind: "number",
      usual: "",
      limits: { min: 4, max: 500, step: 1 },
    },
    {
      name: "smoothness",
      label: "Smoothness",
      says: "How much bending costs: η, as a share of what is minimised. Large ones flatten the curve.",
      kind: "number",
      usual: "1e-10",
      limits: { min: 0, max: 1e6, step: "any" },
      isAdvanced: true,
    },
    {
      name: "nonnegative",
      label: "Keep K² from below 0",
      says: "Without it the closed form of eq. (13) is taken, and put to 0 where it is negative.",
      kind: "switch",
      usual: "true",
      isAdvanced: true,
    },
    ...LEARNED,
  ],
  grid: [
    {
      name: "points",
      label: "Points of the grid",
      says: "At so many λ the value of K² is learned.",
      kind: "number",
      usual: "30",
      limits: { min: 2, max: 500, step: 1 },
    },
    {
      name: "interpolation",
      label: "Between the points",
      says: "How values follow from those on the grid.",
      kind: "choice",
      usual: "linear",
      choices: { linear: "linear in ln λ", nearest: "that of the nearest point" },
      isAdvanced: true,
    },
    ...LEARNED,
  ],
  "heat-time": LEARNED,
  heat: [
    {
      name: "time",
      label: "Time",
      says: "Short: details. Long: large parts. In the inverse unit of λ.",
      kind: "number",
      usual: "0.15",
      limits: { min: 1e-9, max: 1e9, step: "any" },
    },
    unit("first-eigenvalue"),
    VIEW,
  ],
  "commute-time": [unit("area"), VIEW],
  biharmonic: [VIEW],
  "shape-dna": [
    {
      name: "eigenvalues",
      label: "Eigenvalues",
      says: "How many of the first ones.",
      kind: "number",
      usual: "20",
      limits: { min: 1, max: 100, step: 1 },
    },
    VIEW,
  ],
};

/** What is sent: parameters that were changed. */
export function parametersOf(method: string, values: Values): Record<string, Json> {
  const given = (PARAMETERS[method] ?? []).filter(({ name, usual }) => (values[name] ?? usual).trim() !== usual);
  return Object.fromEntries(given.map((parameter) => [parameter.name, jsonOf(parameter, values[parameter.name]!)]));
}

function jsonOf(parameter: Parameter, text: string): Json {
  if (parameter.kind === "number") return Number(text);
  if (parameter.kind === "switch") return text === "true";
  return parameter.kind === "several" ? text.split(",").filter(Boolean) : text;
}
