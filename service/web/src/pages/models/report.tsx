// What the training of a model found.

import type { Model } from "../../api/types";
import { BankFigures } from "./bank";
import { bankReport, kernelReport } from "./reports";
import { KernelFigures } from "./single";
import { METHODS } from "./words";

export function Report(props: { model: Model }) {
  const { model } = props;
  const [bank, kernel] = [bankReport(model), kernelReport(model)];
  if (bank === null && kernel === null && !METHODS[model.method]?.learns) return null;
  return (
    <section class="panel" aria-labelledby="report">
      <h2 id="report">What its training found</h2>
      {bank !== null && <BankFigures report={bank} name={model.name} />}
      {kernel !== null && <KernelFigures report={kernel} name={model.name} />}
      {bank === null && kernel === null && <p class="quiet">Nothing was kept of its training.</p>}
    </section>
  );
}
