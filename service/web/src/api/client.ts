// Requests to the service: JSON in, JSON or a Problem out.

import { signal } from "@preact/signals";

const ROOT = new URL(".", document.baseURI);
const KEY_NAME = "proteus-key";

/** Where a path of the API is: "v1/models". */
export function urlOf(path: string): string {
  return new URL(path, ROOT).href;
}

/** What went wrong, in words: the service's problem, or that it does not answer. */
export class Problem extends Error {
  constructor(
    readonly status: number,
    readonly title: string,
    readonly detail: string,
    readonly type: string = "",
  ) {
    super(detail || title);
  }

  /** Nobody answered: it may be back in a moment. */
  get isAway(): boolean {
    return this.status === 0 || this.status === 502 || this.status === 503 || this.status === 504;
  }
}

/** Whether the service answered last time. */
export const serviceAnswers = signal(true);
/** Whether a key has to be given, since the service refused without or with the one given. */
export const keyIsNeeded = signal(false);
const key = signal<string | null>(readKey());

/** Whether requests carry a key; pictures then cannot be fetched by the browser alone. */
export function hasKey(): boolean {
  return key.value !== null;
}

export function giveKey(value: string): void {
  key.value = value.trim() || null;
  try {
    if (key.value === null) sessionStorage.removeItem(KEY_NAME);
    else sessionStorage.setItem(KEY_NAME, key.value);
  } catch {
    // a browser that stores nothing asks again after a reload
  }
  keyIsNeeded.value = false;
}

function readKey(): string | null {
  try {
    return sessionStorage.getItem(KEY_NAME);
  } catch {
    return null;
  }
}

export interface Options {
  method?: string;
  json?: unknown;
  form?: FormData;
  signal?: AbortSignal;
}

/** The answer to a request; throws a Problem where it is none of success. */
export async function send(path: string, options: Options = {}): Promise<Response> {
  const headers = new Headers({ Accept: "application/json" });
  if (key.value !== null) headers.set("Authorization", `Bearer ${key.value}`);
  if (options.json !== undefined) headers.set("Content-Type", "application/json");
  const body = options.json !== undefined ? JSON.stringify(options.json) : options.form;
  let response: Response;
  try {
    response = await fetch(urlOf(path), {
      method: options.method ?? (body === undefined ? "GET" : "POST"),
      headers,
      body: body ?? null,
      signal: options.signal ?? null,
      keepalive: options.method === "DELETE", // it may be the last thing a closing page does
    });
  } catch (error) {
    if (options.signal?.aborted) throw error;
    serviceAnswers.value = false;
    throw new Problem(0, "The service does not answer", "It may be starting again; this page tries on.");
  }
  serviceAnswers.value = true;
  if (response.ok) return response;
  if (response.status === 401) keyIsNeeded.value = true;
  throw await problemOf(response);
}

async function problemOf(response: Response): Promise<Problem> {
  try {
    const problem = await response.json();
    return new Problem(response.status, problem.title ?? "", problem.detail ?? "", problem.type ?? "");
  } catch {
    return new Problem(response.status, `The service answered ${response.status}`, response.statusText);
  }
}

/** A JSON answer. */
export async function ask<Answer>(path: string, options: Options = {}): Promise<Answer> {
  const response = await send(path, options);
  return (response.status === 204 ? undefined : await response.json()) as Answer;
}

/** A binary answer. */
export async function fetchBytes(path: string, signal?: AbortSignal): Promise<ArrayBuffer> {
  const response = await send(path, signal ? { signal } : {});
  return response.arrayBuffer();
}

/** `?a=1&b=2` of what is given; empty without. */
export function queryText(parameters: Record<string, string | number | null | undefined>): string {
  const given = Object.entries(parameters).filter(([, value]) => value !== null && value !== undefined && value !== "");
  return given.length ? `?${new URLSearchParams(given.map(([name, value]) => [name, String(value)]))}` : "";
}

/** A form sent with progress, which `fetch` does not report. */
export function upload<Answer>(
  path: string,
  form: FormData,
  progress: (share: number) => void,
  signal?: AbortSignal,
): Promise<{ answer: Answer; location: string | null; status: number }> {
  return new Promise((resolve, reject) => {
    const request = new XMLHttpRequest();
    request.open("POST", urlOf(path));
    request.setRequestHeader("Accept", "application/json");
    if (key.value !== null) request.setRequestHeader("Authorization", `Bearer ${key.value}`);
    request.upload.onprogress = (event) => event.lengthComputable && progress(event.loaded / event.total);
    request.onerror = () => {
      serviceAnswers.value = false;
      reject(new Problem(0, "The service does not answer", "The upload was interrupted; try again."));
    };
    request.onabort = () => reject(new DOMException("stopped", "AbortError"));
    request.onload = async () => {
      serviceAnswers.value = true;
      if (request.status >= 200 && request.status < 300) {
        resolve({
          answer: JSON.parse(request.responseText) as Answer,
          location: request.getResponseHeader("Location"),
          status: request.status,
        });
        return;
      }
      if (request.status === 401) keyIsNeeded.value = true;
      reject(await problemOf(new Response(request.responseText, { status: request.status || 500 })));
    };
    signal?.addEventListener("abort", () => request.abort());
    request.send(form);
  });
}
