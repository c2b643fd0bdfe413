// Models: how shapes are described and compared; those there are, each of them, and new ones.

import { route } from "../../router";
import { ModelList } from "./list";
import { OneModel } from "./model";
import { TrainPage } from "./train";
import "./models.css";

export function ModelsPage() {
  const { path, query } = route.value;
  const name = path[1];
  const list = query.has("train") ? <TrainPage /> : <ModelList />;
  return <div class="modelpage">{name === undefined ? list : <OneModel key={name} name={name} />}</div>;
}
