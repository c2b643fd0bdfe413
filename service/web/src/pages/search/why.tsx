// Why a shape was found: what each channel saw of both, and its part of their distance.

import { useState } from "preact/hooks";
import type { ComparedChannel, Comparison } from "../../api/types";
import { Plot, type Series } from "../../plots/plot";
import { Trouble } from "../../ui/basics";
import type { Loaded } from "../../ui/loading";
import { brief, share } from "../../ui/words";

const FEW = 8;

export function Why(props: { comparison: Loaded<Comparison> }) {
  const { value, problem, again } = props.comparison;
  const [chosen, choose] = useState<string | null>(null);
  const [all, showAll] = useState(false);
  if (value === null) return problem ? <Trouble problem={problem} again={again} /> : <p class="loading">Comparing…</p>;
  const channels = all ? value.channels : value.channels.slice(0, FEW);
  const channel = value.channels.find((one) => one.name === chosen) ?? value.channels[0];
  if (!channel) return null;
  return (
    <details class="why" open>
      <summary>
        <h2>Why they match</h2>
        <span class="quiet">distance {brief(value.distance)}, the sum of these parts</span>
      </summary>
      <div class="columns">
        <div>
          <ol class="channels">
            {channels.map((one) => (
              <li key={one.name}>
                <ChannelBar channel={one} whole={value.distance} isChosen={one.name === channel.name} choose={() => choose(one.name)} />
              </li>
            ))}
          </ol>
          {value.channels.length > FEW && (
            <button type="button" class="plain small" onClick={() => showAll(!all)}>
              {all ? "The largest parts only" : `All ${value.channels.length} channels`}
            </button>
          )}
        </div>
        <ChannelPlot channel={channel} />
      </div>
    </details>
  );
}

function ChannelBar(props: { channel: ComparedChannel; whole: number; isChosen: boolean; choose: () => void }) {
  const { channel, whole } = props;
  const part = whole > 0 ? channel.share / whole : 0;
  return (
    <button type="button" class="channel plain" aria-pressed={props.isChosen} onClick={props.choose}>
      <span class="name">{channel.name}</span>
      <meter min={0} max={1} value={part} aria-label={`part of the distance by ${channel.name}`} />
      <span class="number">{share(part)}</span>
    </button>
  );
}

function ChannelPlot(props: { channel: ComparedChannel }) {
  const { channel } = props;
  const { axis } = channel;
  const isOfPoints = axis.kind === "times";
  const series: Series[] = [
    { name: "query", points: pointsOf(channel, channel.asked_values), steps: axis.kind === "edges" },
    { name: "found", points: pointsOf(channel, channel.values), steps: axis.kind === "edges" },
  ];
  const names = { edges: "distance", levels: "share of the surface", index: "number of the eigenvalue", times: "time" };
  const label = isOfPoints ? "ln k(x,x), middle of all points" : axis.kind === "edges" ? "share of pairs" : axis.kind === "index" ? "ln of the eigenvalue" : "ln k(x,x), quantile";
  return (
    <Plot
      title={`What the channel ${channel.name} sees of both`}
      series={series}
      x={{ label: names[axis.kind], log: isOfPoints }}
      y={{ label }}
      height={300}
      legend
      file={`${channel.name.replaceAll(/[^\w.-]+/g, "-")}.svg`}
    />
  );
}

/** Values over their axis; of points the median at each time. */
function pointsOf(channel: ComparedChannel, values: number[]): [number, number][] {
  const { axis } = channel;
  if (axis.kind !== "times") {
    const places = axis.values.length ? axis.values : values.map((_, i) => i + 1);
    return values.map((value, i) => [places[i] ?? i + 1, value]);
  }
  const times = axis.values;
  return times.map((time, i) => {
    const column = values.filter((_, j) => j % times.length === i).sort((a, b) => a - b);
    return [time, column[Math.floor(column.length / 2)] ?? Number.NaN];
  });
}
