// Precision by recall: how much of what is found is right, as ever more of what is right is found.

import type { Evaluation } from "../../api/types";
import { Plot } from "../../plots/plot";
import { saveCsv } from "../../plots/save";

export function Recall(props: { evaluation: Evaluation }) {
  const { collection, models, precision_recall } = props.evaluation;
  const curves = models.map((model) => ({
    name: model,
    points: (precision_recall[model] ?? []).map(([recall = 0, precision = 0]) => [recall, precision] as const),
  }));
  const rows = curves.flatMap(({ name, points }) => points.map((point) => [name, ...point]));
  return (
    <section class="panel" aria-labelledby="recall">
      <h2 id="recall">Precision and recall</h2>
      <p class="quiet">How much of what is found is right (up), by how much of what is right is found (across).</p>
      <Plot
        title={`Precision by recall of ${models.join(", ")}`}
        series={curves}
        x={{ label: "recall, per cent", range: [0, 100] }}
        y={{ label: "precision, per cent", range: [0, 100] }}
        legend
        file={`${collection}-precision-recall.svg`}
      />
      <button
        type="button"
        class="small"
        onClick={() => saveCsv([["model", "recall", "precision"], ...rows], `${collection}-precision-recall.csv`)}
      >
        Save as CSV
      </button>
    </section>
  );
}
