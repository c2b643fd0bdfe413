// Shapes that could have been asked with and were not, and why.

import type { Evaluation } from "../../api/types";
import { linkTo } from "../../router";
import { count, fileName } from "../../ui/words";
import { REASONS } from "./words";

export function Skipped(props: { skipped: Evaluation["skipped"] }) {
  const { skipped } = props;
  if (skipped.length === 0) return null;
  return (
    <section class="panel" aria-labelledby="skipped">
      <h2 id="skipped">What was not asked with</h2>
      {skipped.map(({ reason, count: number, shapes }) => (
        <details key={reason}>
          <summary>
            {count(number, "shape")} {REASONS[reason] ?? reason}
          </summary>
          <ul class="skipped">
            {shapes.map((shape) => (
              <li key={shape.id}>
                <a href={linkTo(["shapes", shape.id])}>{fileName(shape.name)}</a>
              </li>
            ))}
            {number > shapes.length && <li>and {number - shapes.length} more</li>}
          </ul>
        </details>
      ))}
    </section>
  );
}
