// The demo collection, one click away.

import { useState } from "preact/hooks";

export function DemoButton() {
  const [isBusy, setBusy] = useState(false);
  const load = async () => {
    setBusy(true);
    await (await import("../pages/collections/demo")).loadDemo();
    setBusy(false);
  };
  return (
    <button type="button" disabled={isBusy} onClick={() => void load()}>
      {isBusy ? "Loading…" : "Load the demo collection"}
    </button>
  );
}
