// What the training of a single kernel found, as a table.

import { brief, count } from "../../ui/words";
import { Fact } from "./facts";
import { Failures, SourceSentence } from "./source";
import type { KernelReport } from "./reports";
import { unitName } from "./words";

const KERNELS: Record<string, string> = {
  learned: "this kernel",
  "commute-time": "commute time",
  heat: "heat at its best time",
  "closed-form": "without the bound at 0",
};

export function KernelFigures(props: { report: KernelReport; name: string }) {
  const { report } = props;
  return (
    <>
      <SourceSentence source={report.source} />
      <p>
        {count(report.pairs, "pair")} of a shape and its copy, of {report.classes.join(", ")}.
        {report.heldOut.length > 0 &&
          ` Held out, to be tested on: ${count(report.heldOutPairs, "pair")} of ${report.heldOut.join(", ")}.`}
      </p>
      <Failures failed={report.failed} one="pair" />
      <h3>Change by transformations, relative to differences between shapes</h3>
      <p class="quiet">The criterion that is learned by, eq. (7) of the paper. Less is better.</p>
      <div class="scrolled">
        <CriterionTable report={report} />
      </div>
      <dl class="facts">
        {facts(report).map(([name, value]) => (
          <Fact key={name} name={name} value={value} />
        ))}
      </dl>
    </>
  );
}

function facts(report: KernelReport): [string, string][] {
  const { heatTime, slope, range, unit } = report;
  const found: [string, string | null][] = [
    ["Best time of the heat kernel", heatTime === null ? null : brief(heatTime)],
    ["Slope of ln K² on ln λ", slope === null ? null : `${slope.toFixed(2).replace("-", "−")} (commute time: −1)`],
    ["Eigenvalues learned from", range === null ? null : `${brief(range[0])} to ${brief(range[1])}`],
    ["Shapes are brought to", unitName(unit)],
  ];
  return found.filter((fact): fact is [string, string] => fact[1] !== null);
}

function CriterionTable(props: { report: KernelReport }) {
  const { training, heldOut } = props.report.criterion;
  const columns = heldOut === null ? [training] : [training, heldOut];
  return (
    <table>
      <caption class="unseen">The criterion of this and other kernels</caption>
      <thead>
        <tr>
          <th scope="col">Kernel</th>
          <th scope="col" class="number">
            Classes learned from
          </th>
          {heldOut !== null && (
            <th scope="col" class="number">
              Classes held out
            </th>
          )}
        </tr>
      </thead>
      <tbody>
        {Object.keys(training).map((name) => (
          <tr key={name}>
            <th scope="row">{KERNELS[name] ?? name}</th>
            {columns.map((column, i) => (
              <td key={i} class="number">
                {column[name] === undefined ? "–" : brief(column[name])}
              </td>
            ))}
          </tr>
        ))}
      </tbody>
    </table>
  );
}
