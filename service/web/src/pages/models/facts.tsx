// What a model is: its parameters, who uses it, what its descriptors depend on.

import type { Collection, Json, Model } from "../../api/types";
import { linkTo } from "../../router";
import { brief } from "../../ui/words";
import { fusionSentence, METHODS, methodName } from "./words";

const PARAMETERS: Record<string, string> = {
  time: "Time of the heat kernel",
  unit: "Unit of the eigenvalues",
  view: "View",
  views: "Views",
  eigenvalues: "Eigenvalues",
  criterion: "What changes least",
  margin: "How far K² goes on",
  splines: "Splines",
  smoothness: "Smoothness",
  nonnegative: "Kept from below 0",
  points: "Points of the grid",
  interpolation: "Between the points",
  power: "Power of the fusion",
  channels: "Channels at most",
};

export function Facts(props: { model: Model; users: Collection[] }) {
  const { model, users } = props;
  const versions = Object.entries(model.versions).sort();
  return (
    <section class="panel" aria-labelledby="facts">
      <h2 id="facts">What it is</h2>
      <p>
        <strong>{methodName(model.method)}.</strong> {METHODS[model.method]?.says}
      </p>
      {model.channels.length > 0 && <p>{fusionSentence(model.fusion.power, model.channels.length)}</p>}
      <dl class="facts">
        <dt>Used by</dt>
        <dd>
          {users.length === 0 && "no collection"}
          {users.map((collection, i) => (
            <span key={collection.name}>
              {i > 0 && ", "}
              <a href={linkTo(["collections", collection.name])}>{collection.name}</a>
            </span>
          ))}
        </dd>
        {Object.entries(model.parameters).map(([name, value]) => (
          <Fact key={name} name={PARAMETERS[name] ?? name} value={valueName(value)} />
        ))}
      </dl>
      <details>
        <summary>What its descriptors depend on</summary>
        <p class="quiet">
          Versions of the program's parts. Descriptors of equal versions can be compared, wherever they were made.
        </p>
        <dl class="facts">
          {versions.map(([name, version]) => (
            <Fact key={name} name={name} value={version} />
          ))}
        </dl>
      </details>
    </section>
  );
}

export function Fact(props: { name: string; value: string }) {
  return (
    <>
      <dt>{props.name}</dt>
      <dd>{props.value}</dd>
    </>
  );
}

/** A parameter in words. */
export function valueName(value: Json): string {
  if (value === null) return "chosen by the method";
  if (typeof value === "number") return brief(value);
  if (typeof value === "boolean") return value ? "yes" : "no";
  if (Array.isArray(value)) return value.map(valueName).join(", ");
  if (typeof value === "object") return Object.keys(value).join(", ");
  return VALUES[value] ?? value;
}

const VALUES: Record<string, string> = {
  none: "that of the meshes",
  area: "surface area 1",
  "first-eigenvalue": "first eigenvalue 1",
  distance: "squared distances",
  kernel: "the kernel k(x,x′)",
  nearest: "the nearest point's value",
  linear: "linear in ln λ",
};
