// What the training of a model found.

import type { Model } from "../../api/types";
import { BankFigures } from "./bank";
import { bankReport, kernelReport } from "./reports";
import { KernelFigures } from "./single";
import { BUILT_IN, METHODS } from "./words";

export function Report(props: { model: Model }) {
  const { model } = props;
  const [bank, kernel] = [bankReport(model), kernelReport(model)];
  if (bank === null && kernel === null && !METHODS[model.method]?.learns) return null;
  return (
    <section class="panel" aria-labelledby="report">
      <h2 id="report">What its training found</h2>
      {bank !== null && <BankFigures report={bank} name={model.name} />}
      {kernel !== null && <KernelFigures report={kernel} name={model.name} />}
      {bank === null && kernel === null && <p class="quiet">{withoutReport(model.name)}</p>}
    </section>
  );
}

function withoutReport(name: string): string {
  return BUILT_IN.has(name)
    ? "This model came with the program. The report of its training lies beside it in the source, and what it finds " +
        "is told in docs/method.md. Evaluate it to see what it finds on shapes of yours."
    : "Nothing was kept of its training.";
}
