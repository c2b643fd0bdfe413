// Short messages at the page's edge, with a way back where there is one.

import { signal } from "@preact/signals";
import { asProblem } from "./loading";

interface Toast {
  id: number;
  text: string;
  kind: "note" | "failed";
  action: { name: string; act: () => void } | null;
}

const UNDO_MILLISECONDS = 7000;
const NOTE_MILLISECONDS = 5000;
const BACK_MILLISECONDS = 15_000;
const toasts = signal<Toast[]>([]);
let last = 0;

function show(text: string, kind: Toast["kind"], action: Toast["action"], milliseconds: number): number {
  const id = ++last;
  toasts.value = [...toasts.value, { id, text, kind, action }].slice(-4);
  window.setTimeout(() => dismiss(id), milliseconds);
  return id;
}

function dismiss(id: number): void {
  toasts.value = toasts.value.filter((toast) => toast.id !== id);
}

/** Say what was done; where it can be gone back on, for longer and with a button for it. */
export function notify(text: string, back: Toast["action"] = null): void {
  if (back === null) {
    show(text, "note", null, NOTE_MILLISECONDS);
    return;
  }
  const act = () => {
    dismiss(id);
    back.act();
  };
  const id = show(text, "note", { name: back.name, act }, BACK_MILLISECONDS);
}

export function notifyProblem(error: unknown): void {
  const problem = asProblem(error);
  show(problem.detail || problem.title, "failed", null, 2 * NOTE_MILLISECONDS);
}

const pending = new Map<number, () => void>();
window.addEventListener("pagehide", () => pending.forEach((act) => act()));

/**
 * Do something that cannot be taken back, unless it is within a few seconds. What the page shows
 * is changed at once by the caller; `undone` puts it back.
 */
export function doLater(text: string, act: () => void, undone: () => void): void {
  let id = 0;
  const settle = () => {
    window.clearTimeout(timer);
    pending.delete(id);
  };
  const timer = window.setTimeout(() => {
    settle();
    act();
  }, UNDO_MILLISECONDS);
  const undo = () => {
    settle();
    dismiss(id);
    undone();
  };
  id = show(text, "note", { name: "Undo", act: undo }, UNDO_MILLISECONDS);
  pending.set(id, act);
}

export function Toasts() {
  return (
    <div class="toasts" role="status" aria-live="polite">
      {toasts.value.map((toast) => (
        <div key={toast.id} class={`toast is-${toast.kind}`}>
          <span>{toast.text}</span>
          {toast.action && (
            <button type="button" onClick={toast.action.act}>
              {toast.action.name}
            </button>
          )}
          <button type="button" class="plain" aria-label="Dismiss" onClick={() => dismiss(toast.id)}>
            ✕
          </button>
        </div>
      ))}
    </div>
  );
}
