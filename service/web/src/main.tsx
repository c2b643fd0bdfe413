// The page: a bar with its parts, and the part that the address names.

import "./styles/tokens.css";
import "./styles/page.css";
import "./styles/parts.css";
import "./styles/views.css";
import { render } from "preact";
import { useEffect, useRef, useState } from "preact/hooks";
import { ask, giveKey, keyIsNeeded, serviceAnswers, urlOf } from "./api/client";
import { linkTo, route } from "./router";
import { SearchPage } from "./pages/search/search";
import { Dialog, Field } from "./ui/basics";
import { later } from "./ui/later";
import { chooseTheme, theme, type Theme } from "./ui/theme";
import { Toasts } from "./ui/toasts";

const PAGES = {
  search: { name: "Search", show: SearchPage },
  collections: { name: "Collections", show: later(async () => (await import("./pages/collections/collections")).CollectionsPage) },
  shapes: { name: "Shape", show: later(async () => (await import("./pages/shape/shape")).ShapePage) },
  models: { name: "Models", show: later(async () => (await import("./pages/models/models")).ModelsPage) },
  evaluations: { name: "Evaluations", show: later(async () => (await import("./pages/evaluations/evaluations")).EvaluationsPage) },
  jobs: { name: "Jobs", show: later(async () => (await import("./pages/jobs/jobs")).JobsPage) },
} as const;
type PageName = keyof typeof PAGES;
const IN_BAR: PageName[] = ["search", "collections", "models", "evaluations", "jobs"];
const AGAIN_MILLISECONDS = 2000;

function isPage(name: string): name is PageName {
  return Object.hasOwn(PAGES, name);
}

function Frame() {
  const [name = "search"] = route.value.path;
  const main = useRef<HTMLElement>(null);
  const page = isPage(name) ? PAGES[name] : null;
  useEffect(() => {
    document.title = page === null ? "Proteus" : `${page.name} · Proteus`;
  }, [page]);
  return (
    <>
      <a class="skip" href="#content" onClick={(event) => { event.preventDefault(); main.current?.focus(); }}>
        Skip to the content
      </a>
      <Bar present={name} />
      <Away />
      <main id="content" ref={main} tabIndex={-1}>
        {page === null ? <NoSuchPage /> : <page.show key={name} />}
      </main>
      <Toasts />
      {keyIsNeeded.value && <KeyDialog />}
    </>
  );
}

function Bar(props: { present: string }) {
  return (
    <header class="topbar">
      <a class="brand" href="#/">
        <img src={urlOf("favicon.svg")} alt="" width={28} height={28} />
        Proteus
      </a>
      <nav aria-label="Parts of the page">
        {IN_BAR.map((name) => (
          <a key={name} href={linkTo([name])} aria-current={props.present === name ? "page" : undefined}>
            {PAGES[name].name}
          </a>
        ))}
        <a href={urlOf("docs")}>API</a>
      </nav>
      <ThemeChoice />
    </header>
  );
}

function ThemeChoice() {
  return (
    <label class="theme">
      <span class="unseen">Colours</span>
      <select value={theme.value} onChange={(event) => chooseTheme(event.currentTarget.value as Theme)}>
        <option value="auto">Auto</option>
        <option value="light">Light</option>
        <option value="dark">Dark</option>
      </select>
    </label>
  );
}

/** That the service does not answer, for as long as it does not. */
function Away() {
  const answers = serviceAnswers.value;
  useEffect(() => {
    if (answers) return;
    const timer = window.setInterval(() => void ask("healthz").catch(() => {}), AGAIN_MILLISECONDS);
    return () => window.clearInterval(timer);
  }, [answers]);
  if (answers) return null;
  return (
    <p class="away" role="status">
      The service does not answer. Nothing is lost; this page goes on when it is back.
    </p>
  );
}

function KeyDialog() {
  const [key, setKey] = useState("");
  return (
    <Dialog title="A key is needed" close={() => (keyIsNeeded.value = false)}>
      <form
        onSubmit={(event) => {
          event.preventDefault();
          giveKey(key);
          location.reload();
        }}
      >
        <Field label="Key" hint="It begins with proteus_ and is kept until this tab is closed.">
          {(id) => (
            <input id={id} type="password" required value={key} autocomplete="off" onInput={(event) => setKey(event.currentTarget.value)} />
          )}
        </Field>
        <button type="submit" class="main">
          Use it
        </button>
      </form>
    </Dialog>
  );
}

function NoSuchPage() {
  return (
    <div class="empty">
      <h1>There is no such page</h1>
      <p>
        <a href="#/">Search for a shape</a>
      </p>
    </div>
  );
}

render(<Frame />, document.getElementById("page")!);
