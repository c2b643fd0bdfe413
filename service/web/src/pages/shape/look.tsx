// The shape in three dimensions, plain or with k(x,x) or an eigenfunction as colours.

import { useMemo, useState } from "preact/hooks";
import { fetchBytes } from "../../api/client";
import type { Shape } from "../../api/types";
import { Field } from "../../ui/basics";
import { useLoad } from "../../ui/loading";
import { brief, fileName } from "../../ui/words";
import { rangeOf } from "../../viewer/colours";
import { floats, KernelChoice, useSignatures, type PaintedKernel } from "../../viewer/signatures";
import { Legend, Viewer } from "../../viewer/viewer";

const EIGENFUNCTIONS = 50;

export function Look(props: { shape: Shape }) {
  const place = `v1/shapes/${props.shape.id}`;
  const [kernel, setKernel] = useState<PaintedKernel | null>(null);
  const [number, setNumber] = useState<number | null>(null);
  const [wireframe, setWireframe] = useState(false);
  const signature = useSignatures([place], number === null ? kernel : null);
  const eigenfunction = useEigenfunction(place, number);
  const field = number === null ? (signature.fields?.[0] ?? null) : eigenfunction;
  const chooseKernel = (chosen: PaintedKernel | null) => {
    setNumber(null);
    setKernel(chosen);
  };
  return (
    <section>
      <Viewer mesh={`${place}/mesh?format=glb`} name={fileName(props.shape.name)} field={field} wireframe={wireframe}>
        <button type="button" class="plain small" aria-pressed={wireframe} onClick={() => setWireframe(!wireframe)}>
          Wireframe
        </button>
      </Viewer>
      <div class="row">
        <KernelChoice chosen={number === null ? kernel : null} choose={chooseKernel} />
        <Field label={number === null ? "Eigenfunction" : `Eigenfunction ${number}`}>
          {(id) => (
            <input
              id={id}
              type="range"
              min={0}
              max={EIGENFUNCTIONS}
              value={number ?? 0}
              onInput={(event) => setNumber(Number(event.currentTarget.value) || null)}
            />
          )}
        </Field>
      </div>
      {field && (
        <Legend
          range={field.range}
          scheme={field.scheme}
          label={number === null ? "area · k(x,x)" : `φ${number}(x)`}
          format={number === null ? signature.format : brief}
        />
      )}
    </section>
  );
}

function useEigenfunction(place: string, number: number | null) {
  const found = useLoad(
    async (signal) => (number === null ? null : floats(await fetchBytes(`${place}/eigenfunction?number=${number}`, signal))),
    [place, number],
  );
  return useMemo(() => {
    if (number === null || found.value === null) return null;
    return { values: found.value, range: rangeOf([found.value], "diverging"), scheme: "diverging" as const };
  }, [found.value, number === null]);
}
