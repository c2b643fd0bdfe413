// What narrows a search: tests of a shape's fields, as they stand in the address and as the service takes them.

import type { Condition, Filter } from "../../api/types";

type Value = string | number;

export type How = "is" | "is not" | "at least" | "at most" | "under" | "not under";
const OF_PATHS: readonly How[] = ["under", "not under", "is", "is not"];
const OF_OTHERS: readonly How[] = ["is", "is not", "at least", "at most"];

/** One test, as it is read: "label", "is not", "cat". */
export interface Test {
  field: string;
  how: How;
  value: string;
}

const FIELDS = /^(label|name|path|transformation|strength|metadata(\.[^.]{1,100}){1,8})$/;

export function isField(field: string): boolean {
  return FIELDS.test(field);
}

/** How a field may be tested; a path is under each of its folders. */
export function howsOf(field: string): readonly How[] {
  return field === "path" ? OF_PATHS : OF_OTHERS;
}

/** The tests of an address; what is none is left out. */
export function testsOf(text: string | null): Test[] {
  let parsed: unknown;
  try {
    parsed = JSON.parse(text ?? "[]");
  } catch {
    return [];
  }
  return (Array.isArray(parsed) ? parsed : []).flatMap((one) => {
    if (!Array.isArray(one) || !one.every((part) => typeof part === "string")) return [];
    const [field = "", how = "", value = ""] = one as string[];
    return isField(field) && howsOf(field).includes(how as How) && value ? [{ field, how: how as How, value }] : [];
  });
}

/** The tests as they stand in an address; nothing without any. */
export function textOf(tests: readonly Test[]): string | null {
  return tests.length ? JSON.stringify(tests.map(({ field, how, value }) => [field, how, value])) : null;
}

/** The service's filter; several allowed values of one field are alternatives, and so are several folders. */
export function filterOf(tests: readonly Test[]): Filter | null {
  if (tests.length === 0) return null;
  const allowed = new Map<string, Value[]>();
  const folders: Condition[] = [];
  const [must, refused]: [Condition[], Condition[]] = [[], []];
  for (const { field, how, value } of tests) {
    if (how === "is") allowed.set(field, [...(allowed.get(field) ?? []), ...meant(field, value)]);
    else if (how === "is not") refused.push({ field, in: meant(field, value) });
    else if (how === "under") folders.push({ field, under: value });
    else if (how === "not under") refused.push({ field, under: value });
    else must.push({ field, range: { [how === "at least" ? "gte" : "lte"]: numberOf(value) ?? value } });
  }
  const paths = allowed.get("path");
  if (paths && folders.length) {
    folders.push({ field: "path", in: paths });
    allowed.delete("path");
  }
  must.unshift(...[...allowed].map(([field, values]) => ({ field, in: values })));
  if (folders.length === 1) must.push(...folders.splice(0));
  return {
    ...(must.length && { must }),
    ...(refused.length && { must_not: refused }),
    ...(folders.length && { should: folders }),
  };
}

/** What a person can have meant: in metadata, 3 is a number or a text; a strength is a number. */
function meant(field: string, value: string): Value[] {
  const number = numberOf(value);
  if (field === "strength") return [number ?? value];
  return field.startsWith("metadata.") && number !== null ? [value, number] : [value];
}

function numberOf(value: string): number | null {
  const number = Number(value);
  return value.trim() && Number.isFinite(number) ? number : null;
}
