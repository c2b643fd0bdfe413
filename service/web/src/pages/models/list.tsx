// The list of models, of which single kernels can be laid over each other.

import type { Collection, Model } from "../../api/types";
import { change, linkTo, route } from "../../router";
import { Badge, Empty, Heading, Trouble } from "../../ui/basics";
import { useEvery } from "../../ui/loading";
import { ago } from "../../ui/words";
import { Compare } from "./compare";
import { singleCurve } from "./curves";
import { useCollections, useModels } from "./load";
import { hidden } from "./remove";
import { methodName, summary } from "./words";

const AGAIN_MILLISECONDS = 5000;
const FIRST_COMPARED = ["commute-time", "heat"];

export function ModelList() {
  const models = useModels();
  const collections = useCollections();
  const trains = models.value?.some((model) => model.state === "training") ?? false;
  useEvery(trains ? AGAIN_MILLISECONDS : null, models.again);
  const shown = (models.value ?? []).filter((model) => !hidden.value.has(model.name));
  return (
    <>
      <Heading
        title="Models"
        hint="A model says how shapes are described and compared. Each collection is searched under one."
      >
        <a class="button main" href={linkTo(["models"], { train: 1 })}>
          Train a model
        </a>
      </Heading>
      <Trouble problem={models.problem} again={models.again} />
      {models.value === null && models.problem === null && <p class="loading">Loading…</p>}
      {models.value !== null && shown.length === 0 && (
        <Empty title="There are no models">
          <p>The built-in ones are written when the service starts for the first time. Train one of your own.</p>
        </Empty>
      )}
      {shown.length > 0 && <Table models={shown} collections={collections.value ?? []} />}
      {shown.length > 0 && <Compare models={shown.filter((model) => compared(shown).has(model.name))} />}
    </>
  );
}

/** Names of the models that are compared: as the address says, else the kernels that everybody knows. */
function compared(models: Model[]): ReadonlySet<string> {
  const named = route.value.query.get("compare");
  if (named !== null) return new Set(named.split(","));
  return new Set(FIRST_COMPARED.filter((name) => models.some((model) => model.name === name)));
}

function Table(props: { models: Model[]; collections: Collection[] }) {
  const chosen = compared(props.models);
  const toggle = (name: string) => {
    const next = chosen.has(name) ? [...chosen].filter((other) => other !== name) : [...chosen, name];
    change({ compare: next.filter(Boolean).join(",") || "none" });
  };
  return (
    <div class="panel scrolled models">
      <table>
        <caption class="unseen">Models, their state, and the collections that are searched under them</caption>
        <thead>
          <tr>
            <th scope="col">Name</th>
            <th scope="col">What it is</th>
            <th scope="col">State</th>
            <th scope="col">Used by</th>
            <th scope="col">Made</th>
            <th scope="col">Compare</th>
          </tr>
        </thead>
        <tbody>
          {props.models.map((model) => (
            <Row
              key={model.name}
              model={model}
              users={props.collections.filter((collection) => collection.model === model.name)}
              isCompared={chosen.has(model.name)}
              toggle={() => toggle(model.name)}
            />
          ))}
        </tbody>
      </table>
    </div>
  );
}

function Row(props: { model: Model; users: Collection[]; isCompared: boolean; toggle: () => void }) {
  const { model, users } = props;
  return (
    <tr>
      <th scope="row">
        <a href={linkTo(["models", model.name])}>{model.name}</a>
      </th>
      <td title={methodName(model.method)}>{summary(model)}</td>
      <td>
        <Badge state={model.state} />
      </td>
      <td>
        {users.map((collection, i) => (
          <span key={collection.name}>
            {i > 0 && ", "}
            <a href={linkTo(["collections", collection.name])}>{collection.name}</a>
          </span>
        ))}
      </td>
      <td>
        <time dateTime={model.created_at} title={new Date(model.created_at).toLocaleString()}>
          {ago(model.created_at)}
        </time>
      </td>
      <td>
        {singleCurve(model) !== null && (
          <input
            type="checkbox"
            aria-label={`Draw the kernel of ${model.name}`}
            checked={props.isCompared}
            onChange={props.toggle}
          />
        )}
      </td>
    </tr>
  );
}
