// One shape: to be turned, its numbers, its spectrum, its fields in colours, shapes like it.

import type { ComponentChildren } from "preact";
import { useState } from "preact/hooks";
import { ask, hasKey, send, urlOf } from "../../api/client";
import type { QueryResult, Shape, Spectrum } from "../../api/types";
import { Plot } from "../../plots/plot";
import { save } from "../../plots/save";
import { linkTo, route } from "../../router";
import { Badge, Empty, Heading, Similarity, Thumbnail, Trouble } from "../../ui/basics";
import { useEvery, useLoad } from "../../ui/loading";
import { notifyProblem } from "../../ui/toasts";
import { ago, brief, fileName, foldersOf, grouped } from "../../ui/words";
import { Look } from "./look";
import "./shape.css";

const FORMATS = ["ply", "off", "obj", "stl", "glb"] as const;
const LIKE = 8;
const AGAIN_MILLISECONDS = 1500;

export function ShapePage() {
  const [, id = ""] = route.value.path;
  const shape = useLoad<Shape>((signal) => ask(`v1/shapes/${id}`, { signal }), [id]);
  const waits = shape.value?.state === "queued" || shape.value?.state === "processing";
  useEvery(waits ? AGAIN_MILLISECONDS : null, shape.again);
  if (shape.value === null) {
    return shape.problem ? <Trouble problem={shape.problem} again={shape.again} /> : <p class="loading">Loading…</p>;
  }
  return <One key={id} shape={shape.value} />;
}

function One(props: { shape: Shape }) {
  const { shape } = props;
  const hint = (
    <>
      <a href={linkTo(["collections", shape.collection])}>{shape.collection}</a>
      {shape.label && <> · {shape.label}</>} · <Badge state={shape.state} />
    </>
  );
  return (
    <>
      <Heading title={fileName(shape.name)} hint={hint}>
        <a class="button main" href={linkTo(["search", shape.collection], { shape: shape.id })}>
          Search with it
        </a>
      </Heading>
      {shape.state === "failed" && shape.error && (
        <Empty title="This mesh could not be used">
          <p>{shape.error.detail}</p>
        </Empty>
      )}
      {shape.state !== "failed" && shape.state !== "ready" && <p class="loading">It is being computed…</p>}
      <div class="sheet">
        {shape.state === "ready" && <Look shape={shape} />}
        <div>
          <Facts shape={shape} />
          <Downloads shape={shape} />
        </div>
      </div>
      {shape.state === "ready" && (
        <div class="columns">
          <SpectrumPanel id={shape.id} />
          <Alike shape={shape} />
        </div>
      )}
    </>
  );
}

function Facts(props: { shape: Shape }) {
  const { shape } = props;
  const facts: [string, ComponentChildren][] = [
    ["Path", <PathOf key="path" shape={shape} />],
    ["Vertices", shape.n_vertices === null ? null : grouped(shape.n_vertices)],
    ["Faces", shape.n_faces === null ? null : grouped(shape.n_faces)],
    ["Area", shape.area === null ? null : `${brief(shape.area)} in the file's unit, squared`],
    ["Components", shape.n_components === null ? null : grouped(shape.n_components)],
    ["Boundary loops", shape.n_boundary_loops === null ? null : shape.n_boundary_loops === 0 ? "none: closed" : grouped(shape.n_boundary_loops)],
    ["Format", shape.format?.toUpperCase() ?? null],
    ["Transformation", shape.transformation && `${shape.transformation}${shape.strength === null ? "" : `, strength ${shape.strength}`}`],
    ["Added", ago(shape.created_at)],
    ...Object.entries(shape.metadata).map(([name, value]): [string, string] => [name, typeof value === "string" ? value : JSON.stringify(value)]),
  ];
  return (
    <section class="panel">
      <h2>What it is</h2>
      <dl class="facts">
        {facts
          .filter(([, value]) => value !== null)
          .map(([name, value]) => (
            <div key={name} class="fact">
              <dt>{name}</dt>
              <dd>{value}</dd>
            </div>
          ))}
      </dl>
      <Notes title="Repairs" notes={shape.repairs} none="None were needed." isKnown={shape.state === "ready"} />
      <Notes
        title="Left alone"
        notes={shape.found}
        none="There was nothing but the mesh in the file."
        isKnown={shape.state === "ready"}
      />
    </section>
  );
}

/** Where it lay; a click on a folder shows what else is there. */
function PathOf({ shape }: { shape: Shape }) {
  return (
    <>
      {foldersOf(shape.path).map((folder) => (
        <span key={folder}>
          <a href={linkTo(["collections", shape.collection], { path: folder })} title={`Shapes in ${folder}`}>
            {fileName(folder)}
          </a>
          /
        </span>
      ))}
      {fileName(shape.path)}
    </>
  );
}

function Notes(props: { title: string; notes: readonly string[]; none: string; isKnown: boolean }) {
  const { title, notes } = props;
  if (notes.length === 0 && !props.isKnown) return null;
  return (
    <>
      <h3>{title}</h3>
      {notes.length === 0 ? (
        <p class="quiet">{props.none}</p>
      ) : (
        <ul>
          {notes.map((note) => (
            <li key={note}>{note}</li>
          ))}
        </ul>
      )}
    </>
  );
}

function Downloads(props: { shape: Shape }) {
  const { shape } = props;
  const stem = fileName(shape.name).replace(/\.\w+$/, "");
  const fetchWithKey = async (event: MouseEvent, path: string, name: string) => {
    if (!hasKey()) return;
    event.preventDefault();
    await send(path)
      .then(async (response) => save(await response.blob(), name))
      .catch(notifyProblem);
  };
  const link = (format: string, name: string, text: string) => {
    const path = `v1/shapes/${shape.id}/mesh?format=${format}`;
    return (
      <a key={format} class="button" href={urlOf(path)} download={name} onClick={(event) => fetchWithKey(event, path, name)}>
        {text}
      </a>
    );
  };
  return (
    <section class="panel">
      <h2>Download</h2>
      <div class="row">
        {link("original", fileName(shape.name), "As uploaded")}
        {shape.state === "ready" && FORMATS.map((format) => link(format, `${stem}.${format}`, format.toUpperCase()))}
      </div>
    </section>
  );
}

function SpectrumPanel(props: { id: string }) {
  const spectrum = useLoad<Spectrum>((signal) => ask(`v1/shapes/${props.id}/spectrum`, { signal }), [props.id]);
  const found = spectrum.value;
  return (
    <section class="panel">
      <h2>Spectrum</h2>
      <Trouble problem={spectrum.problem} again={spectrum.again} />
      {found && (
        <Plot
          title="Eigenvalues of the Laplace-Beltrami operator"
          series={[
            { name: "this shape", points: found.eigenvalues.map((value, i) => [i + 1, value * found.area]) },
            { name: "Weyl: 4π number", points: found.eigenvalues.map((_, i) => [i + 1, 4 * Math.PI * (i + 1)]), dashed: true },
          ]}
          x={{ label: "number" }}
          y={{ label: "eigenvalue × area" }}
          file="spectrum.svg"
        />
      )}
    </section>
  );
}

function Alike(props: { shape: Shape }) {
  const { shape } = props;
  const [all, setAll] = useState(false);
  const found = useLoad<QueryResult>(
    (signal) => ask(`v1/collections/${shape.collection}/query`, { json: { shape_id: shape.id, limit: LIKE }, signal }),
    [shape.id],
  );
  const matches = found.value?.matches ?? [];
  return (
    <section class="panel">
      <h2>Shapes like it</h2>
      <Trouble problem={found.problem} again={found.again} />
      {found.value && matches.length === 0 && <p class="quiet">It is the only one in its collection.</p>}
      <ul class="cards">
        {matches.slice(0, all ? LIKE : 4).map((match) => (
          <li key={match.shape.id}>
            <a class="card" href={linkTo(["search", shape.collection], { shape: shape.id, match: match.shape.id })}>
              <Thumbnail shape={match.shape} size={96} />
              <span class="name">{match.shape.label ?? fileName(match.shape.name)}</span>
              <Similarity value={match.similarity} />
            </a>
          </li>
        ))}
      </ul>
      {matches.length > 4 && (
        <button type="button" class="plain small" onClick={() => setAll(!all)}>
          {all ? "Fewer" : "More"}
        </button>
      )}
    </section>
  );
}
