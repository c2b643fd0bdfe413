// A shape in the grid: its picture or why there is none, its name, label and state.

import { useState } from "preact/hooks";
import type { Shape } from "../../api/types";
import { linkTo } from "../../router";
import { Badge, sentence, Thumbnail } from "../../ui/basics";
import { notify, notifyProblem } from "../../ui/toasts";
import { fileName, foldersOf } from "../../ui/words";
import { tryAgain } from "./retry";

const IN_WORDS = { queued: "waiting", processing: "being computed", ready: "ready", failed: "failed" };

interface Props {
  shape: Shape;
  isChosen: boolean;
  choose: (isChosen: boolean, toHere: boolean) => void;
  /** It is to be computed again. */
  queued: () => void;
  changed: () => void;
}

export function ShapeCard(props: Props) {
  const { shape } = props;
  const name = fileName(shape.name);
  const folder = foldersOf(shape.path).at(-1) ?? "";
  const reason = shape.state === "failed" ? sentence(shape.error?.detail ?? "no reason is known") : null;
  return (
    <div class={`card shapecard${props.isChosen ? " chosen" : ""}`}>
      <label class="pick">
        <input
          type="checkbox"
          checked={props.isChosen}
          aria-label={`Select ${name}`}
          onClick={(event) => props.choose(event.currentTarget.checked, event.shiftKey)}
        />
      </label>
      <a href={linkTo(["shapes", shape.id])}>
        {reason === null ? (
          <Thumbnail shape={shape} />
        ) : (
          <span class="reason" title={reason}>
            {reason}
          </span>
        )}
        <span class="name" title={name}>
          {name}
        </span>
      </a>
      <small class="quiet name">{shape.label ?? "no label"}</small>
      {shape.path !== name && (
        <small class="quiet name folder" title={shape.path}>
          <bdi>{folder || shape.path}</bdi>
        </small>
      )}
      <div class="foot">
        <Badge state={shape.state}>{IN_WORDS[shape.state]}</Badge>
        {reason !== null && <AgainButton {...props} name={name} />}
      </div>
    </div>
  );
}

function AgainButton(props: Props & { name: string }) {
  const [isBusy, setBusy] = useState(false);
  const again = async () => {
    setBusy(true);
    try {
      const job = await tryAgain(props.shape);
      if (job === null)
        notify(`No job was found in which ${props.name} could be tried again. Delete it and add it anew.`);
      else {
        props.queued();
        props.changed();
      }
    } catch (error) {
      notifyProblem(error);
    } finally {
      setBusy(false);
    }
  };
  return (
    <button
      type="button"
      class="small"
      disabled={isBusy}
      aria-label={`Try ${props.name} again`}
      onClick={() => void again()}
    >
      Try again
    </button>
  );
}
