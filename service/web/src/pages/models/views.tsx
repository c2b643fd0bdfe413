// How shapes are prepared under a model, step by step.

import type { Model } from "../../api/types";
import { sentence } from "../../ui/basics";
import { stepName } from "./words";

export function Views(props: { views: Model["views"] }) {
  const { views } = props;
  return (
    <section class="panel" aria-labelledby="views">
      <h2 id="views">How shapes are prepared</h2>
      <p class="quiet">
        {views.length > 1
          ? "Each shape is looked at in several views. Each view is a mesh of its own, made in these steps:"
          : "Stored shapes and those that are asked with alike, in these steps:"}
      </p>
      {views.map((view) => (
        <div key={view.name} class="viewsteps">
          <h3>View “{view.name}”</h3>
          <ol>
            {view.steps.map((step, i) => (
              <li key={i}>{sentence(stepName(step))}</li>
            ))}
            <li>Compute the first {view.eigenpairs} eigenvalues and eigenfunctions of its Laplacian.</li>
          </ol>
        </div>
      ))}
    </section>
  );
}
