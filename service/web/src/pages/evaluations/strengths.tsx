// How models do as transformations grow stronger: a small plot for each transformation.

import type { ByModel, Evaluation } from "../../api/types";
import { COLOURS, Plot } from "../../plots/plot";
import { saveCsv } from "../../plots/save";

export function Strengths(props: { evaluation: Evaluation }) {
  const { collection, models, by_strength } = props.evaluation;
  const transformations = Object.entries(by_strength);
  if (transformations.length === 0) return null;
  const strengths = strengthsOf(transformations.map(([, rows]) => rows));
  return (
    <section class="panel" aria-labelledby="strengths">
      <h2 id="strengths">By strength</h2>
      <p class="quiet">Mean average precision in per cent (up), by the strength of each transformation (across).</p>
      <ul class="legend">
        {models.map((model, i) => (
          <li key={model}>
            <i class={`mark colour-${i % COLOURS}`} aria-hidden="true" />
            {model}
          </li>
        ))}
      </ul>
      <div class="multiples">
        {transformations.map(([name, rows]) => (
          <div key={name}>
            <h3>{name}</h3>
            <Plot
              title={`${name}: mean average precision by strength, of ${models.join(", ")}`}
              series={models.map((model) => ({ name: model, points: pointsOf(rows, model), dots: true }))}
              x={{ label: "strength", range: [strengths[0]!, strengths.at(-1)!], ticks: strengths }}
              y={{ label: "mAP, per cent", range: [0, 100] }}
              width={320}
              height={230}
              legend={false}
              file={`${collection}-${name}-by-strength.svg`}
            />
          </div>
        ))}
      </div>
      <button
        type="button"
        class="small"
        onClick={() => saveCsv(csvRows(transformations, models), `${collection}-by-strength.csv`)}
      >
        Save as CSV
      </button>
    </section>
  );
}

function strengthsOf(rows: Record<string, ByModel>[]): number[] {
  const found = new Set(rows.flatMap((row) => Object.keys(row).map(Number)));
  return [...found].filter(Number.isFinite).sort((a, b) => a - b);
}

function pointsOf(rows: Record<string, ByModel>, model: string): [number, number][] {
  return Object.entries(rows)
    .map(([strength, row]): [number, number] => [Number(strength), row[model] ?? Number.NaN])
    .sort((a, b) => a[0] - b[0]);
}

function csvRows(transformations: [string, Record<string, ByModel>][], models: string[]): (string | number | null)[][] {
  return [
    ["transformation", "strength", ...models],
    ...transformations.flatMap(([name, rows]) =>
      Object.entries(rows).map(([strength, row]) => [name, strength, ...models.map((model) => row[model] ?? null)]),
    ),
  ];
}
