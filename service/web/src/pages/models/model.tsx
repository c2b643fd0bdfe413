// One model: what it is made of, what its training found, and what it is used for.

import { useState } from "preact/hooks";
import { ask } from "../../api/client";
import type { Collection, Model } from "../../api/types";
import { go, linkTo } from "../../router";
import { Badge, Heading, Trouble } from "../../ui/basics";
import { useLoad } from "../../ui/loading";
import { ago } from "../../ui/words";
import { Channels } from "./channels";
import { CurvePlots } from "./compare";
import { singleCurve } from "./curves";
import { Facts } from "./facts";
import { BankKernels } from "./kernels";
import { useCollections } from "./load";
import { remove } from "./remove";
import { Report } from "./report";
import { Training } from "./training";
import { Moves, UseDialog } from "./use";
import { Views } from "./views";
import { BUILT_IN, summary } from "./words";

export function OneModel(props: { name: string }) {
  const { name } = props;
  const model = useLoad<Model>((signal) => ask(`v1/models/${encodeURIComponent(name)}`, { signal }), [name]);
  const collections = useCollections();
  if (model.value === null) {
    if (model.problem === null) return <p class="loading">Loading…</p>;
    return (
      <>
        <Heading title={name} hint={<a href={linkTo(["models"])}>All models</a>} />
        <Trouble problem={model.problem} again={model.again} />
      </>
    );
  }
  const users = (collections.value ?? []).filter((collection) => collection.model === name);
  return (
    <>
      <Head model={model.value} users={users} collections={collections.value} />
      <Moves model={name} moved={collections.again} />
      {model.value.state === "ready" ? (
        <Ready model={model.value} users={users} />
      ) : (
        <Training model={model.value} changed={model.again} />
      )}
    </>
  );
}

interface HeadProps {
  model: Model;
  users: Collection[];
  collections: Collection[] | null;
}

function Head(props: HeadProps) {
  const { model, users } = props;
  const [isChoosing, choose] = useState(false);
  const isReady = model.state === "ready";
  const hint = (
    <>
      <a href={linkTo(["models"])}>Models</a> · {summary(model)} · <Badge state={model.state} /> · made{" "}
      <time dateTime={model.created_at} title={new Date(model.created_at).toLocaleString()}>
        {ago(model.created_at)}
      </time>
    </>
  );
  return (
    <>
      <Heading title={model.name} hint={hint}>
        {isReady && (
          <button type="button" class="main" onClick={() => choose(true)}>
            Use it for…
          </button>
        )}
        {isReady && (
          <a class="button" href={linkTo(["evaluations"], { new: 1, models: model.name })}>
            Evaluate it
          </a>
        )}
        {!BUILT_IN.has(model.name) && model.state !== "training" && (
          <button type="button" class="danger" onClick={() => remove(model.name, users) && go(linkTo(["models"]))}>
            Delete
          </button>
        )}
      </Heading>
      {isChoosing && <UseDialog model={model.name} collections={props.collections} close={() => choose(false)} />}
    </>
  );
}

function Ready(props: { model: Model; users: Collection[] }) {
  const { model, users } = props;
  const curve = singleCurve(model);
  return (
    <>
      <div class="columns apart">
        <Facts model={model} users={users} />
        <Views views={model.views} />
      </div>
      {curve !== null && (
        <section class="panel" aria-labelledby="curve">
          <h2 id="curve">Its kernel</h2>
          <CurvePlots curves={[curve]} file={`${model.name}-kernel`} />
          <p>
            <a href={linkTo(["models"], { compare: [...new Set([model.name, "commute-time", "heat"])].join(",") })}>
              Compare it with other kernels
            </a>
          </p>
        </section>
      )}
      <Report model={model} />
      <Channels model={model} />
      {model.kernels.length > 1 && <BankKernels model={model} />}
    </>
  );
}
