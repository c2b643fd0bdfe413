// Evaluations: how well models find again what belongs together; those there are, each of them, and new ones.

import { route } from "../../router";
import { EvaluationList } from "./list";
import { OneEvaluation } from "./one";
import { NewEvaluation } from "./start";
import "./evaluations.css";

export function EvaluationsPage() {
  const { path, query } = route.value;
  const id = path[1];
  const list = query.has("new") ? <NewEvaluation /> : <EvaluationList />;
  return <div class="evaluationpage">{id === undefined ? list : <OneEvaluation key={id} id={id} />}</div>;
}
