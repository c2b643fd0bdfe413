// The demo collection, for those who have no meshes yet: an archive that lies beside the page.

import { ask, Problem, send } from "../../api/client";
import { go, linkTo } from "../../router";
import { notifyProblem } from "../../ui/toasts";
import { pickChosen } from "./files";
import { uploadsTo } from "./uploads";

const NAME = "demo";
const ARCHIVE = "demo.zip";

/** Make the collection, send the archive, and look at what becomes of it. */
export async function loadDemo(): Promise<void> {
  try {
    const content = await (await send(ARCHIVE)).blob();
    await makeCollection();
    uploadsTo(NAME).add(await pickChosen([new File([content], ARCHIVE)]));
    go(linkTo(["collections", NAME]));
  } catch (error) {
    notifyProblem(error);
  }
}

async function makeCollection(): Promise<void> {
  const json = { name: NAME, description: "Procedural creatures, each in two poses." };
  try {
    await ask("v1/collections", { json });
  } catch (error) {
    if (!(error instanceof Problem && error.status === 409)) throw error;
  }
}
