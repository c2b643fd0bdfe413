// From what a model was learned, and what of it failed.

import type { JobError } from "../../api/types";
import { linkTo } from "../../router";
import { sentence } from "../../ui/basics";
import { count } from "../../ui/words";
import type { Source } from "./reports";

const MOST_FAILURES = 20;

/** From what it was learned, as a sentence. */
export function SourceSentence(props: { source: Source }) {
  const { collection, transformations, strengths, correspondence } = props.source;
  const from = collection ? (
    <>
      from the collection <a href={linkTo(["collections", collection])}>{collection}</a>
    </>
  ) : (
    "from creatures"
  );
  if (correspondence === "vertex-order") {
    return <p>Learned {from}, whose shapes of one label share their vertices' order.</p>;
  }
  return (
    <p>
      Learned {from} under {transformations.join(", ") || "no transformation"}, at{" "}
      {strengths.length === 1 ? "strength" : "strengths"} {strengths.join(", ")}.
    </p>
  );
}

/** What of the training failed, item by item. */
export function Failures(props: { failed: readonly JobError[]; one: string }) {
  const { failed } = props;
  if (failed.length === 0) return null;
  return (
    <details>
      <summary>{count(failed.length, props.one)} could not be used</summary>
      <ErrorList errors={failed} />
    </details>
  );
}

/** Items that failed, and why. */
export function ErrorList(props: { errors: readonly JobError[] }) {
  const { errors } = props;
  return (
    <ul class="errors">
      {errors.slice(0, MOST_FAILURES).map((error, i) => (
        <li key={i}>
          <strong>{error.item}</strong>: {sentence(error.detail)}
        </li>
      ))}
      {errors.length > MOST_FAILURES && <li>and {errors.length - MOST_FAILURES} more</li>}
    </ul>
  );
}
