// Search: a mesh or a stored shape in, ranked shapes out, and why each of them is there.

import { useEffect, useRef, useState } from "preact/hooks";
import { ask } from "../../api/client";
import { hasEnded } from "../../api/jobs";
import type { Collection, Page, QueryResult } from "../../api/types";
import { change, go, linkTo, route } from "../../router";
import { DemoButton } from "../../ui/demo";
import { Bar, Empty, Field, Heading, JobBar, Trouble } from "../../ui/basics";
import { asProblem, useLoad } from "../../ui/loading";
import { JobButtons } from "../jobs/buttons";
import { count } from "../../ui/words";
import { answerOf, askWithMesh, askWithShape, meshOf, type Narrowing, type Stage, type Subject } from "./asking";
import { Comparison } from "./comparison";
import { testsOf, textOf } from "./filters";
import { Results } from "./results";
import { Start } from "./start";
import "./search.css";

const LIKED = "demo"; // shown first where it exists

export function SearchPage() {
  const collections = useLoad(
    (signal) => ask<Page<Collection>>("v1/collections?limit=1000", { signal }).then((page) => page.items),
    [],
  );
  if (collections.value === null) {
    return <>{collections.problem ? <Trouble problem={collections.problem} /> : <p class="loading">Loading…</p>}</>;
  }
  if (collections.value.length === 0) return <NothingToSearch />;
  return <Search collections={collections.value} />;
}

function NothingToSearch() {
  return (
    <Empty title="There is nothing to search yet">
      <p>
        Make a collection and drop your meshes on it, or look around in one of creatures first.
      </p>
      <a class="button main" href={linkTo(["collections"])}>
        Make a collection
      </a>
      <DemoButton />
    </Empty>
  );
}

function chosenCollection(collections: Collection[], named: string | undefined): string {
  if (named) return named;
  const full = collections.filter((collection) => collection.ready_count > 0);
  return (full.find((collection) => collection.name === LIKED) ?? full[0] ?? collections[0]!).name;
}

function readSubject(query: URLSearchParams): Subject | null {
  const [shape, mesh] = [query.get("shape"), query.get("query")];
  return shape ? { kind: "shape", id: shape } : mesh ? { kind: "query", id: mesh } : null;
}

/** An answer and what it answers; both stay in view until the next is there. */
interface Found {
  subject: Subject;
  result: QueryResult;
}

function addressOf({ model, tests }: Narrowing) {
  return { model, where: textOf(tests) };
}

function Search(props: { collections: Collection[] }) {
  const { path, query } = route.value;
  const name = chosenCollection(props.collections, path[1]);
  const subject = readSubject(query);
  const narrowing: Narrowing = {
    model: query.get("model"),
    tests: testsOf(query.get("where")),
  };
  const [stage, setStage] = useState<Stage | null>(null);
  const found = useLoad<Found | null>(
    async (signal) => {
      setStage(null);
      if (subject === null) return null;
      if (subject.kind === "shape") return { subject, result: await askWithShape(name, subject.id, narrowing, signal) };
      return { subject, result: await answerOf(subject.id, setStage, signal) };
    },
    [name, subject?.kind, subject?.id, narrowing.model, query.get("where")],
  );
  const asking = useAsking(name, narrowing, setStage);
  const isBusy = asking.isBusy || found.isLoading;
  const waits = stage !== null && isBusy;

  const wanted = useRef(narrowing); // ahead of the address until a mesh that is sent again has its answer
  if (!isBusy) wanted.current = narrowing;
  /** Other filters: the query is repeated; a mesh has to be sent again. */
  const narrow = async (changed: (now: Narrowing) => Partial<Narrowing>) => {
    wanted.current = { ...wanted.current, ...changed(wanted.current) };
    if (subject?.kind !== "query") return change({ ...addressOf(wanted.current), match: null });
    await asking.again(subject.id, name, wanted.current);
  };
  const again = () => (subject?.kind === "query" ? void asking.again(subject.id, name, narrowing) : found.again());
  const move = async (collection: string) => {
    if (subject?.kind === "query") return asking.again(subject.id, collection, { ...narrowing, model: null });
    go(linkTo(["search", collection], subject ? { shape: subject.id } : {}));
  };
  const collection = props.collections.find((one) => one.name === name);
  return (
    <>
      <Heading
        title="Find a shape"
        hint="Drop a mesh, and get back the same shape in another pose, at another scale, noisy, with holes, coarser, or with parts missing."
      >
        <CollectionChoice collections={props.collections} name={name} move={move} />
      </Heading>
      {subject === null && <Start collection={name} count={collection?.ready_count ?? 0} send={asking.send} isBusy={asking.isBusy} />}
      {waits && <Waiting stage={stage} changed={setStage} />}
      <Trouble problem={asking.problem ?? found.problem} again={asking.problem ? undefined : found.again} />
      {subject !== null && found.value !== null && (
        <Answer {...found.value} isOlder={isBusy} narrowing={narrowing} narrow={narrow} send={asking.send} again={again} />
      )}
    </>
  );
}

function CollectionChoice(props: { collections: Collection[]; name: string; move: (name: string) => void }) {
  const known = props.collections.some((collection) => collection.name === props.name);
  return (
    <Field label="Collection">
      {(id) => (
        <select id={id} value={props.name} onChange={(event) => props.move(event.currentTarget.value)}>
          {!known && <option value={props.name}>{props.name} (not there)</option>}
          {props.collections.map((collection) => (
            <option key={collection.name} value={collection.name}>
              {collection.name} · {count(collection.ready_count, "shape")}
            </option>
          ))}
        </select>
      )}
    </Field>
  );
}

const TITLES: Record<Stage["at"], string> = {
  sending: "Sending the mesh",
  waiting: "Describing the mesh",
  searching: "Searching",
};

function Waiting(props: { stage: Stage | null; changed: (stage: Stage) => void }) {
  const { stage } = props;
  const at = stage?.at ?? "waiting";
  const job = stage?.at === "waiting" ? stage.job : null;
  return (
    <div class="panel" role="status">
      <h2>{TITLES[at]}</h2>
      {job ? (
        <>
          <JobBar job={job} label="describing the mesh" />
          {!hasEnded(job) && <JobButtons job={job} changed={(after) => props.changed({ at: "waiting", job: after })} />}
        </>
      ) : (
        <Bar value={stage?.at === "sending" ? stage.share : null} label={TITLES[at].toLowerCase()} />
      )}
    </div>
  );
}

/** Sending meshes as queries; the answer's address becomes the page's. */
function useAsking(collection: string, narrowing: Narrowing, report: (stage: Stage | null) => void) {
  const [isBusy, setBusy] = useState(false);
  const [problem, setProblem] = useState<ReturnType<typeof asProblem> | null>(null);
  const running = useRef<AbortController | null>(null);
  useEffect(() => () => running.current?.abort(), []);

  const run = async (where: string, how: Narrowing, replace: boolean, file: (signal: AbortSignal) => Promise<File>) => {
    running.current?.abort();
    const abort = new AbortController();
    running.current = abort;
    setBusy(true);
    setProblem(null);
    try {
      const id = await askWithMesh(where, await file(abort.signal), how, report, abort.signal);
      report({ at: "waiting", job: null });
      go(linkTo(["search", where], { query: id, ...addressOf(how) }), { replace });
    } catch (error) {
      if (!abort.signal.aborted) setProblem(asProblem(error));
    } finally {
      if (running.current === abort) setBusy(false);
    }
  };
  return {
    isBusy,
    problem,
    send: (file: File) => run(collection, { ...narrowing, tests: [] }, false, async () => file),
    again: (query: string, where: string, how: Narrowing) => run(where, how, true, (signal) => meshOf(query, signal)),
  };
}

interface AnswerProps extends Found {
  isOlder: boolean;
  narrowing: Narrowing;
  narrow: (changed: (now: Narrowing) => Partial<Narrowing>) => void;
  send: (file: File) => void;
  again: () => void;
}

function Answer(props: AnswerProps) {
  const { subject, result, narrowing } = props;
  const chosen = route.value.query.get("match");
  const match = result.matches.find((one) => one.shape.id === chosen) ?? result.matches[0] ?? null;
  return (
    <div class={props.isOlder ? "answer older" : "answer"} aria-busy={props.isOlder}>
      <Results
        result={result}
        chosen={match?.shape.id ?? null}
        choose={(id) => change({ match: id })}
        narrowing={narrowing}
        narrow={props.narrow}
        send={props.send}
        again={props.again}
        isStored={subject.kind === "shape"}
      />
      {match && <Comparison subject={subject} match={match} model={result.model} />}
    </div>
  );
}
