// All measures over all queries, and one of them by label.

import { useState } from "preact/hooks";
import type { Evaluation, Measures } from "../../api/types";
import { Field } from "../../ui/basics";
import { hasTable } from "./best";
import { Figures, type FigureRow } from "./figures";
import { Differences } from "./table";
import { bounds, MEASURES } from "./words";

const FEW = 12;

export function MeasuresTable(props: { evaluation: Evaluation }) {
  const { evaluation } = props;
  const { models, measures, mean_intervals } = evaluation;
  const rows: FigureRow[] = MEASURES.map((measure) => ({
    key: measure.name,
    name: (
      <>
        <abbr title={`${measure.name}: ${measure.says}`}>{measure.short}</abbr>{" "}
        <small class="quiet measure">
          {measure.name}
          <span class="says">: {measure.says}</span>
        </small>
      </>
    ),
    figures: models.map((model) => measures[model]?.[measure.key] ?? null),
  }));
  const sure = models.filter((model) => mean_intervals[model] && bounds(mean_intervals[model]));
  return (
    <section class="panel" aria-labelledby="measures">
      <h2 id="measures">Over all queries</h2>
      <Figures
        caption="Measures over all queries, in per cent, by model"
        first="Measure"
        models={models}
        rows={rows}
        file={`${evaluation.collection}-measures.csv`}
      />
      {sure.length > 0 && (
        <p class="quiet">
          95 % intervals of mAP:{" "}
          {sure.map((model) => `${model} ${bounds(mean_intervals[model]!).slice(1, -1)}`).join("; ")}.
        </p>
      )}
      {!hasTable(evaluation) && <Differences evaluation={evaluation} />}
    </section>
  );
}

export function ByLabel(props: { evaluation: Evaluation }) {
  const { evaluation } = props;
  const { models, by_label } = evaluation;
  const [key, setKey] = useState<keyof Measures>("map");
  const [isWhole, setWhole] = useState(false);
  const rows: FigureRow[] = Object.entries(by_label)
    .map(([label, row]) => ({ key: label, name: label, figures: models.map((model) => row[model]?.[key] ?? null) }))
    .sort((a, b) => meanOf(a) - meanOf(b) || a.key.localeCompare(b.key));
  return (
    <section class="panel" aria-labelledby="labels">
      <div class="headrow">
        <h2 id="labels">By label</h2>
        <Field label="Measure">
          {(id) => (
            <select id={id} value={key} onChange={(event) => setKey(event.currentTarget.value as keyof Measures)}>
              {MEASURES.map((measure) => (
                <option key={measure.key} value={measure.key}>
                  {measure.name}
                </option>
              ))}
            </select>
          )}
        </Field>
      </div>
      <p class="quiet">Those that are found worst come first.</p>
      <Figures
        caption="One measure by label and model, the worst first"
        first="Label"
        models={models}
        rows={isWhole ? rows : rows.slice(0, FEW)}
        all={rows}
        file={`${evaluation.collection}-by-label.csv`}
      >
        {rows.length > FEW && (
          <button type="button" class="small" onClick={() => setWhole(!isWhole)}>
            {isWhole ? "Show the worst" : `Show all ${rows.length} labels`}
          </button>
        )}
      </Figures>
    </section>
  );
}

function meanOf(row: FigureRow): number {
  return row.figures.reduce<number>((sum, value) => sum + (value ?? 0), 0) / row.figures.length;
}
