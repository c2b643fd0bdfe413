// Collections: all of them, or the one that the address names.

import { route } from "../../router";
import { CollectionList } from "./list";
import { OneCollection } from "./one";
import "./collections.css";

export function CollectionsPage() {
  const [, name] = route.value.path;
  return name === undefined ? <CollectionList /> : <OneCollection key={name} name={name} />;
}
