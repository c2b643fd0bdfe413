// Where the page is: all of it stands in the address, after the #, so that it can be shared.

import { computed, signal } from "@preact/signals";

export interface Route {
  /** "#/shapes/7" has ["shapes", "7"]. */
  path: string[];
  query: URLSearchParams;
}

export type Query = Record<string, string | number | null | undefined>;

const address = signal(location.hash);
window.addEventListener("hashchange", () => (address.value = location.hash));

export const route = computed<Route>(() => parse(address.value));

export function parse(hash: string): Route {
  const [path = "", query = ""] = hash.replace(/^#?\/?/, "").split("?", 2);
  return {
    path: path.split("/").filter(Boolean).map(decoded),
    query: new URLSearchParams(query),
  };
}

/** Address of a place in the page. */
export function linkTo(path: readonly string[], query: Query = {}): string {
  const given = Object.entries(query).filter(([, value]) => value !== null && value !== undefined && value !== "");
  const text = new URLSearchParams(given.map(([name, value]) => [name, String(value)])).toString();
  return `#/${path.map(encodeURIComponent).join("/")}${text ? `?${text}` : ""}`;
}

/** Go there; `replace` leaves no step to go back to. */
export function go(link: string, { replace = false } = {}): void {
  if (replace) {
    history.replaceState(null, "", link);
    address.value = location.hash;
  } else {
    location.hash = link;
  }
}

/** Stay here with other parameters; those that are null go. */
export function change(query: Query, { replace = true } = {}): void {
  const { path, query: present } = route.value;
  go(linkTo(path, { ...Object.fromEntries(present), ...query }), { replace });
}

function decoded(text: string): string {
  try {
    return decodeURIComponent(text);
  } catch {
    return text;
  }
}
