// The choice of transformations, as pictures of what each does.

import { urlOf } from "../../api/client";

/** What each does to a shape; the first eleven are the paper's. */
export const TRANSFORMATIONS: Record<string, string> = {
  isometry: "Another pose: limbs turn, the surface keeps its lengths.",
  topology: "Parts that are near each other are welded together.",
  holes: "Discs are cut out of the surface.",
  "micro-holes": "Many holes as small as a face or a few.",
  scale: "The whole shape is larger or smaller.",
  "local-scale": "Places on it swell or shrink.",
  sampling: "Fewer and larger triangles.",
  noise: "Every vertex is moved a little.",
  "shot-noise": "A few vertices are moved far: spikes.",
  partial: "A part of it is cut off.",
  all: "Many of these at once, each weaker.",
  affine: "Stretched and squeezed along three directions.",
  view: "Only what is seen from one side.",
  scan: "One side of it, as a scanner measures it: in pieces, ragged and rough.",
};
export const NAMES = Object.keys(TRANSFORMATIONS);
export const PAPER = NAMES.slice(0, 11);
const PRESETS: [string, readonly string[]][] = [
  ["The paper's eleven", PAPER],
  ["Noise and holes", ["holes", "micro-holes", "noise", "shot-noise"]],
  ["All fourteen", NAMES],
  ["None", []],
];
export const STRENGTHS = [1, 2, 3, 4, 5] as const;

interface Props {
  chosen: readonly string[];
  choose: (names: string[]) => void;
}

export function TransformationChoice(props: Props) {
  const { chosen, choose } = props;
  const toggle = (name: string) =>
    choose(NAMES.filter((other) => (other === name ? !chosen.includes(name) : chosen.includes(other))));
  return (
    <fieldset>
      <legend>What it should not be fooled by</legend>
      <p class="quiet">Each shape is deformed in these ways, and the model learns to see through them.</p>
      <div class="row presets">
        {PRESETS.map(([name, names]) => (
          <button
            key={name}
            type="button"
            class="small"
            aria-pressed={names.length === chosen.length && names.every((one) => chosen.includes(one))}
            onClick={() => choose([...names])}
          >
            {name}
          </button>
        ))}
      </div>
      <ul class="cards pictures">
        {NAMES.map((name) => (
          <li key={name}>
            <label class={`card${chosen.includes(name) ? " chosen" : ""}`}>
              <img
                src={urlOf(`transformations/${name}.webp`)}
                alt=""
                width={160}
                height={120}
                loading="lazy"
              />
              <span class="tick">
                <input type="checkbox" checked={chosen.includes(name)} onChange={() => toggle(name)} />
                <strong>{name}</strong>
              </span>
              <small class="quiet">{TRANSFORMATIONS[name]}</small>
            </label>
          </li>
        ))}
      </ul>
    </fieldset>
  );
}

export function StrengthChoice(props: { chosen: readonly number[]; choose: (strengths: number[]) => void }) {
  const { chosen, choose } = props;
  return (
    <fieldset>
      <legend>How strongly</legend>
      <div class="row">
        {STRENGTHS.map((strength) => (
          <label key={strength} class="tick">
            <input
              type="checkbox"
              checked={chosen.includes(strength)}
              onChange={() =>
                choose(STRENGTHS.filter((one) => (one === strength ? !chosen.includes(one) : chosen.includes(one))))
              }
            />
            {strength}
            {strength === 1 && <span class="quiet">weakest</span>}
            {strength === 5 && <span class="quiet">strongest</span>}
          </label>
        ))}
      </div>
    </fieldset>
  );
}
