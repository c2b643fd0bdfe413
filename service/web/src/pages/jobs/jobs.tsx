// Jobs: all of them, or the one that the address names.

import { route } from "../../router";
import { OneJob } from "./job";
import { JobList } from "./list";
import "./jobs.css";

export function JobsPage() {
  const [, id] = route.value.path;
  return id === undefined ? <JobList /> : <OneJob key={id} id={id} />;
}
