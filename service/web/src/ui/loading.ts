// Hooks that load: what a component shows, and what went wrong.

import { useCallback, useEffect, useState } from "preact/hooks";
import { Problem, serviceAnswers } from "../api/client";

export interface Loaded<Value> {
  /** The newest answer; that of the parameters before, until the next one is there. */
  value: Value | null;
  problem: Problem | null;
  isLoading: boolean;
  /** Load once more. */
  again: () => void;
}

/** Between two attempts. */
export const AGAIN_MILLISECONDS = 3000;

/** Load when the parameters change; when the service was away, as soon as it is back. */
export function useLoad<Value>(load: (signal: AbortSignal) => Promise<Value>, parameters: unknown[]): Loaded<Value> {
  const [state, setState] = useState<State<Value>>({ value: null, problem: null, of: null });
  const [turn, setTurn] = useState(0);
  const now = [...parameters, turn];
  const again = useCallback(() => setTurn((before) => before + 1), []);
  useEffect(() => {
    const abort = new AbortController();
    let timer = 0;
    load(abort.signal)
      .then((value) => !abort.signal.aborted && setState({ value, problem: null, of: now }))
      .catch((error: unknown) => {
        if (abort.signal.aborted) return;
        const problem = asProblem(error);
        setState((before) => ({ value: problem.isAway ? before.value : null, problem, of: now }));
        if (problem.isAway) timer = window.setTimeout(again, AGAIN_MILLISECONDS);
      });
    return () => {
      abort.abort();
      window.clearTimeout(timer);
    };
  }, now);
  const isLoading = state.of === null || now.some((parameter, place) => parameter !== state.of![place]);
  return { value: state.value, problem: state.problem, isLoading, again };
}

interface State<Value> {
  value: Value | null;
  problem: Problem | null;
  /** The parameters of which this is the answer. */
  of: unknown[] | null;
}

/** Whatever was thrown, in words. */
export function asProblem(error: unknown): Problem {
  if (error instanceof Problem) return error;
  console.error(error);
  return new Problem(-1, "This page made a mistake", error instanceof Error ? error.message : String(error));
}

/** Do something every so often while the component is shown and the window is looked at. */
export function useEvery(milliseconds: number | null, act: () => void): void {
  useEffect(() => {
    if (milliseconds === null) return;
    const timer = window.setInterval(() => {
      if (!document.hidden && serviceAnswers.value) act();
    }, milliseconds);
    return () => window.clearInterval(timer);
  }, [milliseconds, act]);
}
