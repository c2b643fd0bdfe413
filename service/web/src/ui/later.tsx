// Parts of the page that are fetched when they are first shown.

import type { ComponentType } from "preact";
import { useEffect, useState } from "preact/hooks";
import type { Problem } from "../api/client";
import { Trouble } from "./basics";
import { asProblem } from "./loading";

/** Make a component of a module that is loaded when it is needed. */
export function later(load: () => Promise<ComponentType>): ComponentType {
  let found: ComponentType | null = null;
  return function Later() {
    const [, shown] = useState(found !== null);
    const [problem, setProblem] = useState<Problem | null>(null);
    useEffect(() => {
      if (found !== null) return;
      load().then(
        (component) => {
          found = component;
          shown(true);
        },
        (error: unknown) => setProblem(asProblem(error)),
      );
    }, []);
    if (found !== null) {
      const Found = found;
      return <Found />;
    }
    return problem === null ? <p class="loading">Loading…</p> : <Trouble problem={problem} again={() => location.reload()} />;
  };
}
