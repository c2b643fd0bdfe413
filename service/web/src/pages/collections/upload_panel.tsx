// What is being sent to a collection, file by file.

import { useState } from "preact/hooks";
import { linkTo } from "../../router";
import { Badge, Bar } from "../../ui/basics";
import { SkippedFiles } from "../../ui/skipped";
import { bytes, count, grouped, share, shortPath } from "../../ui/words";
import type { Uploads } from "./uploads";
import type { At, Upload } from "./work";
import "./uploads.css";

const SHOWN = 30;
const GROUPS: [name: string, states: At["is"][]][] = [
  ["Failed", ["failed"]],
  ["Being sent", ["sending"]],
  ["Being computed", ["computing"]],
  ["Waiting", ["waiting"]],
  ["Stopped", ["stopped"]],
  ["Ready", ["ready"]],
];

export function UploadPanel(props: { uploads: Uploads }) {
  const { uploads } = props;
  const [isOpen, setOpen] = useState(true);
  const all = uploads.all.value;
  const skipped = uploads.skipped.value;
  if (all.length === 0 && skipped.count === 0) return null;
  return (
    <section class="panel uploads" aria-label="Uploads">
      <header class="row">
        <h2>Uploads</h2>
        <Buttons uploads={uploads} />
        <button type="button" class="small" aria-expanded={isOpen} onClick={() => setOpen(!isOpen)}>
          {isOpen ? "Hide the files" : "Show the files"}
        </button>
      </header>
      {all.length > 0 && <Overall uploads={uploads} />}
      <SkippedFiles {...skipped} />
      {isOpen && GROUPS.map(([name, states]) => <Group key={name} name={name} states={states} uploads={uploads} />)}
    </section>
  );
}

function Buttons(props: { uploads: Uploads }) {
  const { uploads } = props;
  const again = [...(uploads.groups.value.get("failed") ?? []), ...(uploads.groups.value.get("stopped") ?? [])];
  return (
    <>
      {again.length > 1 && (
        <button type="button" class="small" onClick={() => void uploads.retry(again)}>
          Try all {again.length} again
        </button>
      )}
      {uploads.isBusy.value ? (
        <button type="button" class="small danger" onClick={() => uploads.stop()}>
          Stop
        </button>
      ) : (
        <button type="button" class="small" onClick={() => uploads.clear()}>
          Close
        </button>
      )}
    </>
  );
}

function Overall(props: { uploads: Uploads }) {
  const { all, groups, skipped } = props.uploads;
  const number = (is: At["is"]) => groups.value.get(is)?.length ?? 0;
  const settled = number("ready") + number("failed") + number("stopped");
  const parts = [
    `${number("ready")} of ${count(all.value.length, "file")} ready`,
    number("failed") > 0 && `${number("failed")} failed`,
    number("stopped") > 0 && `${number("stopped")} stopped`,
    number("waiting") + number("sending") > 0 && `${number("waiting") + number("sending")} to be sent`,
    skipped.value.count > 0 && `${grouped(skipped.value.count)} skipped`,
  ];
  return (
    <div class="jobbar">
      <Bar value={settled / all.value.length} label="all uploads" />
      <span class="quiet">{parts.filter(Boolean).join(", ")}</span>
    </div>
  );
}

function Group(props: { name: string; states: At["is"][]; uploads: Uploads }) {
  const [shown, setShown] = useState(SHOWN);
  const uploads = props.states.flatMap((is) => props.uploads.groups.value.get(is) ?? []);
  if (uploads.length === 0) return null;
  return (
    <>
      <h3>
        {props.name} <span class="quiet">{uploads.length}</span>
      </h3>
      <ul class="files">
        {uploads.slice(0, shown).map((upload) => (
          <Row key={upload.id} upload={upload} retry={() => void props.uploads.retry([upload])} />
        ))}
      </ul>
      {uploads.length > shown && (
        <button type="button" class="small" onClick={() => setShown(shown + 10 * SHOWN)}>
          Show more of {uploads.length}
        </button>
      )}
    </>
  );
}

function Row(props: { upload: Upload; retry: () => void }) {
  const { upload } = props;
  const at = upload.at.value;
  return (
    <li>
      <span class="name" title={upload.name}>
        {at.is === "ready" && at.shape !== null ? (
          <a href={linkTo(["shapes", at.shape])}>{shortPath(upload.name)}</a>
        ) : (
          shortPath(upload.name)
        )}
      </span>
      <small class="quiet">{sizeOf(upload)}</small>
      <State at={at} />
      {(at.is === "failed" || at.is === "stopped") && (
        <button type="button" class="small" aria-label={`Try ${upload.name} again`} onClick={props.retry}>
          Try again
        </button>
      )}
      {at.is === "failed" && <p class="reason">{at.reason}</p>}
    </li>
  );
}

function sizeOf({ file, needs }: Upload): string {
  const all = [file, ...needs.map((one) => one.file)].reduce((sum, { size }) => sum + size, 0);
  return needs.length === 0 ? bytes(all) : `with ${count(needs.length, "file")}, ${bytes(all)}`;
}

function State(props: { at: At }) {
  const { at } = props;
  if (at.is === "sending") return <Badge state="running">sending {share(at.share.value)}</Badge>;
  if (at.is === "computing") {
    const { progress, id } = at.work.job.value;
    return (
      <a
        href={linkTo(["jobs", id])}
        title={`${progress.done} of ${progress.total} ${progress.unit} of its job are done`}
      >
        <Badge state="processing">computing</Badge>
      </a>
    );
  }
  if (at.is === "ready") return <Badge state="ready">{at.text}</Badge>;
  return <Badge state={at.is === "failed" ? "failed" : "queued"}>{at.is}</Badge>;
}
