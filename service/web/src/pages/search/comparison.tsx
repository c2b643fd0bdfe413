// The query beside one of its matches: two viewers that turn together, and why they match.

import { useCallback, useRef, useState } from "preact/hooks";
import { ask } from "../../api/client";
import type { Comparison as Compared, Match, Shape } from "../../api/types";
import { linkTo } from "../../router";
import { Similarity } from "../../ui/basics";
import { useLoad } from "../../ui/loading";
import { fileName } from "../../ui/words";
import { Legend, Viewer } from "../../viewer/viewer";
import { KernelChoice, useSignatures, type PaintedKernel } from "../../viewer/signatures";
import type { Stage } from "../../viewer/stage";
import { fileOf, type Subject } from "./asking";
import { Why } from "./why";

interface Props {
  subject: Subject;
  match: Match;
  model: string;
}

export function Comparison(props: Props) {
  const { subject, match } = props;
  const place = subject.kind === "shape" ? `v1/shapes/${subject.id}` : `v1/queries/${subject.id}`;
  const found = `v1/shapes/${match.shape.id}`;
  const asked = useLoad<Shape | null>(
    (signal) => (subject.kind === "shape" ? ask<Shape>(place, { signal }) : Promise.resolve(null)),
    [place],
  );
  const why = useLoad<Compared>(
    (signal) => ask(`${found}/comparison?${subject.kind}_id=${subject.id}&model=${encodeURIComponent(props.model)}`, { signal }),
    [found, place, props.model],
  );
  const [kernel, setKernel] = useState<PaintedKernel | null>(null);
  const painted = useSignatures([place, found], kernel);
  const [wireframe, setWireframe] = useState(false);
  const together = useTogether();
  const name = asked.value?.name ?? (subject.kind === "query" ? fileOf(subject.id)?.name : null) ?? "your mesh";
  return (
    <section class="panel comparison" aria-label="The query and the chosen match">
      <div class="pair">
        <Viewer
          mesh={`${place}/mesh?format=glb`}
          name={fileName(name)}
          field={painted.fields?.[0] ?? null}
          wireframe={wireframe}
          ready={together.left}
        >
          {asked.value && <a href={linkTo(["shapes", asked.value.id])}>Open</a>}
        </Viewer>
        <Viewer
          mesh={`${found}/mesh?format=glb`}
          name={fileName(match.shape.name)}
          field={painted.fields?.[1] ?? null}
          wireframe={wireframe}
          ready={together.right}
        >
          <a href={linkTo(["shapes", match.shape.id])}>Open</a>
          <a href={linkTo(["search", match.shape.collection], { shape: match.shape.id })}>Search with it</a>
        </Viewer>
      </div>
      <div class="row">
        <strong>
          Rank {match.rank}
          {match.shape.label && `, ${match.shape.label}`}
        </strong>
        <Similarity value={match.similarity} />
        <KernelChoice chosen={kernel} choose={setKernel} />
        <button type="button" class="small" aria-pressed={wireframe} onClick={() => setWireframe(!wireframe)}>
          Wireframe
        </button>
      </div>
      {painted.fields && (
        <Legend range={painted.range} scheme="sequential" label="area · k(x,x) on both" format={painted.format} />
      )}
      <Why comparison={why} />
    </section>
  );
}

/** Two stages that turn together as soon as both are there. */
function useTogether() {
  const stages = useRef<[Stage | null, Stage | null]>([null, null]);
  const place = useCallback((side: 0 | 1, stage: Stage | null) => {
    stages.current[side] = stage;
    const [left, right] = stages.current;
    if (left && right) left.turnWith(right);
  }, []);
  return {
    left: useCallback((stage: Stage | null) => place(0, stage), [place]),
    right: useCallback((stage: Stage | null) => place(1, stage), [place]),
  };
}
