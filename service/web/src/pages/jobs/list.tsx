// All jobs, the newest first, as they go on.

import { useCallback } from "preact/hooks";
import { ask } from "../../api/client";
import { hasEnded } from "../../api/jobs";
import type { Collection, Job, Page } from "../../api/types";
import { change, linkTo, route } from "../../router";
import { Badge, Empty, Field, Heading, JobBar, Trouble } from "../../ui/basics";
import { useLive } from "../../ui/live";
import { useEvery, useLoad } from "../../ui/loading";
import { count } from "../../ui/words";
import { JobButtons } from "./buttons";
import { Times } from "./times";
import { isKind, isState, KINDS, STATES, titleOf } from "./words";

const PAGE = 50;
const SOON_MILLISECONDS = 2000;
const AGAIN_MILLISECONDS = 10000;

interface Filters {
  state: string | null;
  kind: string | null;
  collection: string | null;
}

export function JobList() {
  const { query } = route.value;
  const filters = { state: query.get("state"), kind: query.get("kind"), collection: query.get("collection") };
  const asked = {
    state: isState(filters.state) ? filters.state : null,
    kind: isKind(filters.kind) ? filters.kind : null,
    collection: filters.collection,
  };
  const list = useLive<Job>("v1/jobs", asked, PAGE, "first");
  const refresh = useCallback(() => void list.refresh((job) => !hasEnded(job)), [list]);
  const jobs = list.items.value.filter((job) => asked.state === null || job.state === asked.state);
  const isOpen = list.items.value.some((job) => !hasEnded(job));
  useEvery(isOpen ? SOON_MILLISECONDS : AGAIN_MILLISECONDS, refresh);
  return (
    <>
      <Heading title="Jobs" hint="Work that takes longer than an answer: computing, training, measuring." />
      <FilterRow filters={asked} />
      <Trouble problem={list.problem.value} again={list.again} />
      {list.isLoading.value && <p class="loading">Loading…</p>}
      {list.isWhole.value && jobs.length === 0 && <Nothing filters={asked} />}
      <ul class="jobs">
        {jobs.map((job) => (
          <Row
            key={job.id}
            job={job}
            changed={(after) => list.change((other) => (other.id === after.id ? after : other))}
          />
        ))}
      </ul>
      {!list.isWhole.value && list.items.value.length > 0 && (
        <button type="button" onClick={() => void list.more()}>
          Show older ones
        </button>
      )}
    </>
  );
}

function FilterRow(props: { filters: Filters }) {
  const { filters } = props;
  const collections = useLoad<Page<Collection>>((signal) => ask("v1/collections?limit=1000", { signal }), []);
  const known = collections.value?.items.map(({ name }) => name) ?? [];
  const names =
    filters.collection === null || known.includes(filters.collection) ? known : [filters.collection, ...known];
  return (
    <form class="row filters" aria-label="Which jobs are shown" onSubmit={(event) => event.preventDefault()}>
      <Choice name="state" title="State" value={filters.state} options={Object.entries(STATES)} />
      <Choice name="kind" title="Kind" value={filters.kind} options={Object.entries(KINDS)} />
      <Choice
        name="collection"
        title="Collection"
        value={filters.collection}
        options={names.map((name) => [name, name])}
      />
    </form>
  );
}

function Choice(props: {
  name: keyof Filters;
  title: string;
  value: string | null;
  options: [value: string, name: string][];
}) {
  return (
    <Field label={props.title}>
      {(id) => (
        <select
          id={id}
          value={props.value ?? ""}
          onChange={(event) => change({ [props.name]: event.currentTarget.value })}
        >
          <option value="">any</option>
          {props.options.map(([value, name]) => (
            <option key={value} value={value}>
              {name}
            </option>
          ))}
        </select>
      )}
    </Field>
  );
}

function Row(props: { job: Job; changed: (job: Job) => void }) {
  const { job } = props;
  return (
    <li class="panel job">
      <div class="what">
        <a href={linkTo(["jobs", job.id])}>{titleOf(job)}</a>
        {job.collection && job.kind !== "describe" && (
          <span class="quiet">
            {" · "}
            <a href={linkTo(["collections", job.collection])}>{job.collection}</a>
          </span>
        )}
        <Times job={job} />
      </div>
      <div class="state">
        <Badge state={job.state}>{STATES[job.state]}</Badge>
        {job.errors.length > 0 && <a href={linkTo(["jobs", job.id])}>{errorsOf(job)}</a>}
      </div>
      <div class="progress">
        {hasEnded(job) ? (
          <span class="quiet">
            {job.progress.done} of {job.progress.total} {job.progress.unit}
            {job.skipped_count > 0 && `, ${count(job.skipped_count, "file")} skipped`}
          </span>
        ) : (
          <JobBar job={job} label={titleOf(job)} />
        )}
      </div>
      <div class="actions">
        <JobButtons job={job} changed={props.changed} />
      </div>
    </li>
  );
}

function errorsOf(job: Job): string {
  return count(job.errors.length, "error");
}

function Nothing(props: { filters: Filters }) {
  if (Object.values(props.filters).some((value) => value !== null)) {
    return (
      <Empty title="No job is like that">
        <button type="button" onClick={() => change({ state: null, kind: null, collection: null })}>
          Show all
        </button>
      </Empty>
    );
  }
  return (
    <Empty title="There was no work yet">
      <p>
        <a href={linkTo(["collections"])}>Add meshes to a collection</a> or{" "}
        <a href={linkTo(["models"])}>train a model</a>; how far it is stands here.
      </p>
    </Empty>
  );
}
