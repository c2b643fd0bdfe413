// The kernels of a bank's channels, coloured by their kind.

import type { KernelCurve, Model } from "../../api/types";
import { Plot } from "../../plots/plot";
import { scaled, seen } from "./curves";
import { eigenvalueLabel, unitName, unitOf } from "./words";

const KINDS: Record<string, string> = {
  heat: "heat: everything below some frequency",
  "mexican-hat": "Mexican hat: a broad band",
  wave: "wave: a narrow band",
  biharmonic: "biharmonic: large parts before details",
  "commute-time": "commute time",
};

export function BankKernels(props: { model: Model }) {
  const { model } = props;
  const kinds = [...new Set(model.kernels.map((curve) => curve.kind))];
  const groups = byUnit(model);
  return (
    <section class="panel" aria-labelledby="kernels">
      <h2 id="kernels">What its kernels let through</h2>
      <p class="quiet">
        Small λ are the large parts of a shape, large λ its details. Each curve is scaled so that its largest λK² is 1.
      </p>
      <ul class="legend">
        {kinds.map((kind, i) => (
          <li key={kind}>
            <i class={`mark colour-${i}`} aria-hidden="true" />
            {KINDS[kind] ?? kind}
          </li>
        ))}
      </ul>
      <div class="columns">
        {groups.map(([unit, curves]) => (
          <div key={unit}>
            <h3>Shapes at {unitName(unit)}</h3>
            <Plot
              title={`λK²(λ) of the bank's kernels at ${unitName(unit)}`}
              series={curves.map((curve) => ({
                name: curve.name,
                points: seen(weighted(curve, unit)),
                colour: kinds.indexOf(curve.kind),
              }))}
              x={{ label: eigenvalueLabel(unit), log: true }}
              y={{ label: "λK²(λ), largest 1", range: [0, 1] }}
              legend={false}
              file={`${model.name}-kernels-${unit}.svg`}
            />
          </div>
        ))}
      </div>
    </section>
  );
}

function weighted(curve: KernelCurve, unit: string): [number, number][] {
  return scaled(curve.name, unit, curve).points.map(([x, y]) => [x, x * y]);
}

/** One curve of each kernel: several channels have the same one. */
function byUnit(model: Model): [string, KernelCurve[]][] {
  const units = new Map<string, Map<string, KernelCurve>>();
  for (const curve of model.kernels) {
    const unit = unitOf(model, curve);
    const known = units.get(unit) ?? new Map<string, KernelCurve>();
    known.set(`${curve.kind} ${JSON.stringify(curve.parameters)}`, curve);
    units.set(unit, known);
  }
  return [...units].map(([unit, curves]) => [unit, [...curves.values()]]);
}
