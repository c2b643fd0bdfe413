// When a job was begun, and how long it took.

import type { Job } from "../../api/types";
import { ago, duration } from "../../ui/words";

export function Times(props: { job: Job }) {
  const { job } = props;
  return (
    <small class="quiet times">
      <time dateTime={job.created_at} title={new Date(job.created_at).toLocaleString("en")}>
        {ago(job.created_at)}
      </time>
      {job.started_at !== null &&
        `, ${job.finished_at === null ? "for" : "took"} ${duration(job.started_at, job.finished_at)}`}
    </small>
  );
}
