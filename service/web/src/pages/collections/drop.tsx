// How files come to a collection: dropped anywhere on its page, chosen, or as a whole folder.

import { useEffect, useRef, useState } from "preact/hooks";
import { notify, notifyProblem } from "../../ui/toasts";
import { pickChosen, pickDropped, type Picked } from "./files";

type Take = (picked: Picked) => void;

export function AddButtons(props: { take: Take }) {
  return (
    <>
      <ChooseButton take={props.take} name="Add meshes" />
      <ChooseButton take={props.take} name="Add a folder" isFolder />
    </>
  );
}

function ChooseButton(props: { take: Take; name: string; isFolder?: boolean }) {
  const input = useRef<HTMLInputElement>(null);
  useEffect(() => {
    if (input.current) input.current.webkitdirectory = props.isFolder ?? false;
  }, [props.isFolder]);
  return (
    <>
      <button type="button" onClick={() => input.current?.click()}>
        {props.name}
      </button>
      {/* any file may be chosen: the content decides what it is, and glTF has others beside it */}
      <input
        ref={input}
        type="file"
        multiple
        hidden
        aria-label={props.name}
        onChange={(event) => {
          take(pickChosen([...(event.currentTarget.files ?? [])]), props.take);
          event.currentTarget.value = "";
        }}
      />
    </>
  );
}

/** Over the whole page while files are dragged: where they would go. */
export function DropAnywhere(props: { collection: string; take: Take }) {
  const [isOver, setOver] = useState(false);
  const taker = useRef(props.take);
  taker.current = props.take;
  useEffect(() => {
    let timer = 0;
    const over = (event: DragEvent) => {
      if (!event.dataTransfer?.types.includes("Files")) return;
      event.preventDefault();
      setOver(true);
      window.clearTimeout(timer); // no more such events: the drag has left the window, or was given up
      timer = window.setTimeout(() => setOver(false), 600);
    };
    const drop = (event: DragEvent) => {
      if (!event.dataTransfer?.types.includes("Files")) return;
      event.preventDefault();
      window.clearTimeout(timer);
      setOver(false);
      take(pickDropped(event.dataTransfer), (picked) => taker.current(picked));
    };
    addEventListener("dragenter", over);
    addEventListener("dragover", over);
    addEventListener("drop", drop);
    return () => {
      window.clearTimeout(timer);
      removeEventListener("dragenter", over);
      removeEventListener("dragover", over);
      removeEventListener("drop", drop);
    };
  }, []);
  if (!isOver) return null;
  return (
    <div class="dropanywhere">
      <p>
        Drop meshes, folders or archives to add them to <strong>{props.collection}</strong>
      </p>
    </div>
  );
}

function take(picked: Promise<Picked>, on: Take): void {
  picked.then((found) => {
    if (found.files.length + found.skipped.length === 0) notify("There was nothing in it that could be added.");
    else on(found);
  }, notifyProblem);
}
