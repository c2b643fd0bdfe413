// Models that are deleted, a few seconds after the person asked for it.

import { signal } from "@preact/signals";
import { ask } from "../../api/client";
import type { Collection } from "../../api/types";
import { doLater, notify, notifyProblem } from "../../ui/toasts";

/** Names of models that are not shown any more, since they are to be deleted. */
export const hidden = signal<ReadonlySet<string>>(new Set());

/** Show a name again: another model has it now, or its own was kept. */
export function reveal(name: string): void {
  hidden.value = new Set([...hidden.value].filter((other) => other !== name));
}

/** Delete a model unless it is used, or the person takes it back; whether it is on its way. */
export function remove(name: string, users: readonly Collection[]): boolean {
  if (users.length > 0) {
    const names = users.map((collection) => collection.name).join(", ");
    notify(`${name} cannot be deleted while it is used by ${names}. Use another model for it first.`);
    return false;
  }
  hidden.value = new Set([...hidden.value, name]);
  doLater(`${name} is deleted`, () => void send(name), () => reveal(name));
  return true;
}

async function send(name: string): Promise<void> {
  try {
    await ask<void>(`v1/models/${encodeURIComponent(name)}`, { method: "DELETE" });
  } catch (error) {
    reveal(name);
    notifyProblem(error);
  }
}
