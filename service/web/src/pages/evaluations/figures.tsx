// A table with a row for each of something and a column for each model, the best of each row marked.

import type { ComponentChildren } from "preact";
import type { Interval } from "../../api/types";
import { saveCsv } from "../../plots/save";
import { linkTo } from "../../router";
import { bounds, figure } from "./words";

export interface FigureRow {
  key: string;
  name: ComponentChildren;
  /** One a model. */
  figures: (number | null)[];
}

interface Props {
  caption: string;
  first: string;
  models: readonly string[];
  rows: readonly FigureRow[];
  /** Below the rows: their means, one a model. */
  means?: { name: string; intervals: Interval[] };
  /** Of the file that is saved; all rows, also those not shown. */
  file: string;
  all?: readonly FigureRow[];
  /** Beside the button that saves it. */
  children?: ComponentChildren;
}

export function Figures(props: Props) {
  const { models, rows, means } = props;
  return (
    <>
      <div class="scrolled">
        <table class="figures">
          <caption class="unseen">{props.caption}</caption>
          <thead>
            <tr>
              <th scope="col">{props.first}</th>
              {models.map((model) => (
                <th key={model} scope="col" class="number">
                  <a href={linkTo(["models", model])}>{model}</a>
                </th>
              ))}
            </tr>
          </thead>
          <tbody>
            {rows.map((row) => (
              <tr key={row.key}>
                <th scope="row">{row.name}</th>
                <Cells figures={row.figures} models={models} />
              </tr>
            ))}
          </tbody>
          {means && (
            <tfoot>
              <tr>
                <th scope="row">{means.name}</th>
                <Cells figures={means.intervals.map((its) => its.value)} models={models} />
              </tr>
              {means.intervals.some((its) => its.low !== null) && (
                <tr>
                  <th scope="row">95 % interval</th>
                  {means.intervals.map((its, i) => (
                    <td key={models[i]} class="number quiet">
                      {bounds(its).slice(1, -1)}
                    </td>
                  ))}
                </tr>
              )}
            </tfoot>
          )}
        </table>
      </div>
      <div class="row below">
        {props.children}
        <button type="button" class="small" onClick={() => saveCsv(csvRows(props), props.file)}>
          Save as CSV
        </button>
      </div>
    </>
  );
}

function Cells(props: { figures: readonly (number | null)[]; models: readonly string[] }) {
  const best = bestOf(props.figures);
  return (
    <>
      {props.figures.map((value, i) => {
        const text = value === null ? "–" : figure(value);
        const isBest = text === best;
        return (
          <td key={props.models[i]} class={isBest ? "number best" : "number"}>
            {text}
            {isBest && <span class="unseen">, the best of the row</span>}
          </td>
        );
      })}
    </>
  );
}

/** The best as it is shown, so that what looks equal is marked alike; none where there is no choice. */
function bestOf(figures: readonly (number | null)[]): string | null {
  const known = figures.filter((value) => value !== null);
  return known.length < 2 ? null : figure(Math.max(...known));
}

function csvRows(props: Props): (string | number | null)[][] {
  const { means } = props;
  return [
    [props.first, ...props.models],
    ...(props.all ?? props.rows).map((row) => [row.key, ...row.figures]),
    ...(means
      ? [
          [means.name, ...means.intervals.map((its) => its.value)],
          ["95 % interval, low", ...means.intervals.map((its) => its.low)],
          ["95 % interval, high", ...means.intervals.map((its) => its.high)],
        ]
      : []),
  ];
}
