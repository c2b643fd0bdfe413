// Kernels laid over each other, as in Figs. 3 and 4 of the paper.

import type { Model } from "../../api/types";
import { Plot } from "../../plots/plot";
import { saveCsv } from "../../plots/save";
import { byUnit, curveRows, SCALED, seen, singleCurve, type Curve } from "./curves";
import { eigenvalueLabel, unitName } from "./words";

export function Compare(props: { models: Model[] }) {
  const curves = props.models.flatMap((model) => singleCurve(model) ?? []);
  return (
    <section class="panel" aria-labelledby="compared">
      <h2 id="compared">Kernels compared</h2>
      {curves.length === 0 ? (
        <p class="quiet">Tick models of one kernel in the table above to lay their curves K²(λ) over each other.</p>
      ) : (
        <CurvePlots curves={curves} file="kernels" />
      )}
    </section>
  );
}

/** Curves on logarithmic axes, those of each unit of λ in axes of their own. */
export function CurvePlots(props: { curves: readonly Curve[]; file: string }) {
  const groups = byUnit(props.curves);
  return (
    <>
      <p class="quiet">
        K²(λ) says how much of each frequency λ of a surface counts: small λ are its large parts, large λ its details.
        {groups.length > 1 && " Kernels whose eigenvalues have different units are drawn apart."}
      </p>
      <div class="curves">
        {groups.map(([unit, curves]) => (
          <div key={unit}>
            {groups.length > 1 && <h3>Shapes at {unitName(unit)}</h3>}
            <Plot
              title={`K²(λ) of ${curves.map((curve) => curve.name).join(", ")}`}
              series={curves.map((curve) => ({
                name: curve.name,
                points: seen(curve.points),
                colour: props.curves.findIndex((one) => one.name === curve.name),
              }))}
              x={{ label: eigenvalueLabel(unit), log: true }}
              y={{ label: SCALED, log: true }}
              legend
              file={`${props.file}-${unit}.svg`}
            />
          </div>
        ))}
      </div>
      <button type="button" class="small" onClick={() => saveCsv(curveRows(props.curves), `${props.file}.csv`)}>
        Save the curves as CSV
      </button>
    </>
  );
}
