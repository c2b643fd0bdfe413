// Table 1: how well each model finds shapes again under each transformation, and how sure that is.

import type { Evaluation } from "../../api/types";
import { linkTo } from "../../router";
import { Figures } from "./figures";
import { withInterval } from "./words";

export function Table1(props: { evaluation: Evaluation }) {
  const { evaluation } = props;
  const { models, table } = evaluation;
  const rows = Object.entries(table).map(([name, row]) => ({
    key: name,
    name,
    figures: models.map((model) => row[model] ?? null),
  }));
  return (
    <section class="panel" aria-labelledby="table1">
      <h2 id="table1">By transformation</h2>
      <p class="quiet">
        Mean average precision in per cent: 100 where everything right comes before everything wrong.
        {models.length > 1 && " A star marks the best of a row."}
      </p>
      <Figures
        caption="Mean average precision by transformation and model"
        first="Transformation"
        models={models}
        rows={rows}
        means={{ name: "Mean of the rows", intervals: models.map((model) => evaluation.mean_of_rows[model]!) }}
        file={`${evaluation.collection}-by-transformation.csv`}
      />
      <Differences evaluation={evaluation} />
    </section>
  );
}

/** How far each model is above the first, and whether that may be chance. */
export function Differences(props: { evaluation: Evaluation }) {
  const { models, differences } = props.evaluation;
  const [first = ""] = models;
  const others = models.slice(1).filter((model) => differences[model]);
  if (others.length === 0) return null;
  return (
    <>
      <h3>Compared with {first}</h3>
      <ul class="differences">
        {others.map((model) => {
          const { mean_of_rows, mean_average_precision } = differences[model]!;
          const its = mean_of_rows ?? mean_average_precision;
          const isSure = its.low !== null && its.high !== null && (its.low > 0 || its.high < 0);
          const points = Math.abs(its.value) < 0.05 ? "level" : `${withInterval(its, true)} points`;
          return (
            <li key={model}>
              <a href={linkTo(["models", model])}>{model}</a>: {points}
              {!isSure && <span class="quiet"> – it may be chance</span>}
            </li>
          );
        })}
      </ul>
      <p class="quiet">In brackets: the range within which 95 per cent of resamplings of the labels lie.</p>
    </>
  );
}
