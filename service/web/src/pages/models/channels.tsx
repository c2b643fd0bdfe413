// The channels of a model, the weightiest first.

import { useState } from "preact/hooks";
import type { Model } from "../../api/types";
import { saveCsv } from "../../plots/save";
import { Field } from "../../ui/basics";
import { brief, count, share } from "../../ui/words";
import { ablationOf } from "./reports";
import { featureName, kernelName, unitName } from "./words";

const HEADINGS = ["Channel", "View", "Kernel", "What is taken", "Size of shapes", "Weight", "Scale"] as const;
const FEW = 12;

export function Channels(props: { model: Model }) {
  const { model } = props;
  const [view, setView] = useState("");
  const [isWhole, setWhole] = useState(false);
  const lost = ablationOf(model);
  const channels = model.channels.filter((channel) => !view || channel.view === view);
  const sorted = [...channels].sort((a, b) => b.weight - a.weight);
  const total = model.channels.reduce((sum, channel) => sum + channel.weight, 0);
  const part = channels.reduce((sum, channel) => sum + channel.weight, 0) / (total || 1);
  const shown = isWhole ? sorted : sorted.slice(0, FEW);
  return (
    <section class="panel" aria-labelledby="channels">
      <div class="headrow">
        <h2 id="channels">{model.channels.length === 1 ? "Its channel" : "Its channels"}</h2>
        {model.views.length > 1 && (
          <Field label="View">
            {(id) => (
              <select id={id} value={view} onChange={(event) => setView(event.currentTarget.value)}>
                <option value="">all</option>
                {model.views.map((one) => (
                  <option key={one.name}>{one.name}</option>
                ))}
              </select>
            )}
          </Field>
        )}
      </div>
      {view && (
        <p class="quiet" role="status">
          {count(channels.length, "channel")} of {model.channels.length}, with {share(part)} of the weight
        </p>
      )}
      <div class="scrolled channels">
        <Table channels={shown} lost={lost} most={sorted[0]?.weight ?? 1} total={total} />
      </div>
      <div class="row">
        {sorted.length > FEW && (
          <button type="button" class="small" onClick={() => setWhole(!isWhole)}>
            {isWhole ? "Show the weightiest" : `Show all ${sorted.length}`}
          </button>
        )}
        <button type="button" class="small" onClick={() => saveCsv(rowsOf(sorted, lost), `${model.name}-channels.csv`)}>
          Save as CSV
        </button>
      </div>
    </section>
  );
}

interface TableProps {
  channels: Model["channels"];
  lost: ReadonlyMap<string, number>;
  most: number;
  total: number;
}

function Table(props: TableProps) {
  const { channels, lost, most, total } = props;
  return (
    <table>
      <caption class="unseen">Channels by weight</caption>
      <thead>
        <tr>
          {HEADINGS.map((heading) => (
            <th key={heading} scope="col" class={heading === "Scale" ? "number" : undefined}>
              {heading}
            </th>
          ))}
          {lost.size > 0 && (
            <th scope="col" class="number" title="Points of mean average precision, on what was held out">
              Lost without it
            </th>
          )}
        </tr>
      </thead>
      <tbody>
        {channels.map((channel) => (
          <tr key={channel.name}>
            <th scope="row">{channel.name}</th>
            <td>{channel.view}</td>
            <td>{kernelName(channel)}</td>
            <td>{featureName(channel)}</td>
            <td>{unitName(channel.normalisation)}</td>
            <td>
              <span class="weight">
                <meter min={0} max={most} value={channel.weight} aria-label={`weight of ${channel.name}`} />
                {((100 * channel.weight) / (total || 1)).toFixed(1)} %
              </span>
            </td>
            <td class="number">{brief(channel.scale)}</td>
            {lost.size > 0 && <td class="number">{lost.get(channel.name)?.toFixed(2).replace("-", "−") ?? "–"}</td>}
          </tr>
        ))}
      </tbody>
    </table>
  );
}

function rowsOf(channels: Model["channels"], lost: ReadonlyMap<string, number>): (string | number | null)[][] {
  return [
    [...HEADINGS, "Lost without it"],
    ...channels.map((channel) => [
      channel.name,
      channel.view,
      kernelName(channel),
      featureName(channel),
      unitName(channel.normalisation),
      channel.weight,
      channel.scale,
      lost.get(channel.name) ?? null,
    ]),
  ];
}
