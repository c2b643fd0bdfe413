// Files of an upload that were no meshes, folded away, each with what it is.

import { useState } from "preact/hooks";
import { sentence } from "./basics";
import { count, grouped } from "./words";

const SHOWN = 200;

interface Props {
  files: readonly { item: string; detail: string }[];
  /** How many there are; not all may be named. */
  count: number;
}

export function SkippedFiles(props: Props) {
  const { files } = props;
  const [isOpen, setOpen] = useState(false);
  if (props.count === 0) return null;
  const more = props.count - Math.min(files.length, SHOWN);
  return (
    <details class="skippedfiles" onToggle={(event) => setOpen(event.currentTarget.open)}>
      <summary>{count(props.count, "file")} skipped</summary>
      <p class="quiet">What is no mesh is left alone.</p>
      {isOpen && (
        <table>
          <thead>
            <tr>
              <th scope="col">File</th>
              <th scope="col">What it is</th>
            </tr>
          </thead>
          <tbody>
            {files.slice(0, SHOWN).map(({ item, detail }, place) => (
              <tr key={place}>
                <td>{item}</td>
                <td>{sentence(detail)}</td>
              </tr>
            ))}
          </tbody>
        </table>
      )}
      {isOpen && more > 0 && <p class="quiet">and {grouped(more)} more</p>}
    </details>
  );
}
