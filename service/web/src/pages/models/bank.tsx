// What the training of a bank found, as tables.

import { Plot } from "../../plots/plot";
import { saveCsv } from "../../plots/save";
import { count, grouped } from "../../ui/words";
import { Failures, SourceSentence } from "./source";
import type { BankReport, Rows } from "./reports";

export function BankFigures(props: { report: BankReport; name: string }) {
  const { report, name } = props;
  return (
    <>
      <SourceSentence source={report.source} />
      <p>
        {count(report.references, "shape")} of {count(report.groups, "group")}, {grouped(report.copies)} deformed copies
        of them, {grouped(report.candidates)} candidate channels.
        {report.heldOut.length > 0 && ` Held out, to be tested on: ${report.heldOut.join(", ")}.`}
      </p>
      <Failures failed={report.failed} one="variant" />
      <div class="columns">
        <RowsTable report={report} name={name} />
        <div>
          <Similarity report={report} />
          <Stages report={report} name={name} />
        </div>
      </div>
    </>
  );
}

function parts(report: BankReport): [string, Rows][] {
  const { training, heldOut } = report.rows;
  return [
    ...(training ? ([["Learned from", training]] as [string, Rows][]) : []),
    ...(heldOut ? ([["Held out", heldOut]] as [string, Rows][]) : []),
  ];
}

function RowsTable(props: { report: BankReport; name: string }) {
  const columns = parts(props.report);
  const names = Object.keys(columns[0]?.[1].map ?? {});
  const rows = [
    ["transformation", ...columns.map(([heading]) => heading)],
    ...names.map((name) => [name, ...columns.map(([, part]) => part.map[name] ?? null)]),
    ["mean of the rows", ...columns.map(([, part]) => part.mean)],
  ];
  return (
    <div>
      <h3>Copies that find their shape</h3>
      <p class="quiet">Mean average precision in per cent: 100 where each copy finds its own shape first.</p>
      <div class="scrolled">
        <table>
          <caption class="unseen">Mean average precision by transformation</caption>
          <thead>
            <tr>
              <th scope="col">Transformation</th>
              {columns.map(([heading]) => (
                <th key={heading} scope="col" class="number">
                  {heading}
                </th>
              ))}
            </tr>
          </thead>
          <tbody>
            {names.map((name) => (
              <tr key={name}>
                <th scope="row">{name}</th>
                {columns.map(([heading, part]) => (
                  <td key={heading} class="number">
                    {part.map[name]?.toFixed(1) ?? "–"}
                  </td>
                ))}
              </tr>
            ))}
          </tbody>
          <tfoot>
            <tr>
              <th scope="row">Mean of the rows</th>
              {columns.map(([heading, part]) => (
                <td key={heading} class="number">
                  <strong>{part.mean.toFixed(1)}</strong>
                </td>
              ))}
            </tr>
            <tr>
              <th scope="row">95 % interval</th>
              {columns.map(([heading, part]) => (
                <td key={heading} class="number quiet">
                  {part.interval ? `${part.interval[0].toFixed(1)} to ${part.interval[1].toFixed(1)}` : "–"}
                </td>
              ))}
            </tr>
          </tfoot>
        </table>
      </div>
      <button type="button" class="small" onClick={() => saveCsv(rows, `${props.name}-training.csv`)}>
        Save as CSV
      </button>
    </div>
  );
}

/** Whether as many impostors come closer as the similarity says. */
function Similarity(props: { report: BankReport }) {
  const { similarity, rows } = props.report;
  if (similarity.length === 0) return null;
  return (
    <>
      <h3>Whether its similarity keeps its word</h3>
      <p class="quiet">
        A similarity of 99 % says that 1 % of other shapes come closer. So many did
        {rows.heldOut ? " among those held out" : ""}:
      </p>
      <div class="scrolled">
        <table>
          <caption class="unseen">Share of other shapes that come closer than a similarity says</caption>
          <thead>
            <tr>
              <th scope="col" class="number">
                Said
              </th>
              <th scope="col" class="number">
                Found
              </th>
            </tr>
          </thead>
          <tbody>
            {similarity.map(({ promised, found }) => (
              <tr key={promised}>
                <td class="number">{(100 * promised).toFixed(1)} %</td>
                <td class="number">{(100 * found).toFixed(1)} %</td>
              </tr>
            ))}
          </tbody>
        </table>
      </div>
    </>
  );
}

/** How the loss on what was held out went as channels were left out, one after the other. */
function Stages(props: { report: BankReport; name: string }) {
  const { stages } = props.report;
  if (stages.length < 3) return null;
  return (
    <details>
      <summary>How many channels it takes</summary>
      <p class="quiet">One channel after the other was left out, always the one that is missed least.</p>
      <Plot
        title="Loss by the number of channels"
        series={[{ name: "loss", points: [...stages].sort((a, b) => a[0] - b[0]) }]}
        x={{ label: "channels that are left" }}
        y={{ label: "loss on what was held out" }}
        height={240}
        file={`${props.name}-stages.svg`}
      />
    </details>
  );
}
