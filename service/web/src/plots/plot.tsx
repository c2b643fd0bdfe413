// Curves in axes, as SVG that can be saved.

import { extent } from "d3-array";
import { scaleLinear, scaleLog } from "d3-scale";
import { line } from "d3-shape";
import type { RefObject } from "preact";
import { useId, useLayoutEffect, useRef, useState } from "preact/hooks";
import { saveSvg } from "./save";
import { tickName, ticksOf } from "./ticks";

export interface Series {
  name: string;
  points: readonly (readonly [number, number])[];
  /** Its place among the colours; that in the list without. */
  colour?: number;
  /** Steps as of a histogram instead of a line. */
  steps?: boolean;
  dashed?: boolean;
  /** A dot at each point. */
  dots?: boolean;
}

interface AxisProps {
  label: string;
  log?: boolean;
  range?: [number, number];
  /** Where its lines are, if that is known better. */
  ticks?: readonly number[];
}

export interface PlotProps {
  title: string;
  series: readonly Series[];
  x: AxisProps;
  y: AxisProps;
  width?: number;
  height?: number;
  legend?: boolean;
  /** The name of the file that is saved. */
  file?: string;
}

export const COLOURS = 8;
const WIDTH = 560;
const NARROW = 280;
const MARGIN = { top: 10, right: 14, bottom: 44, left: 60 };

/** Series over each other in one pair of axes, with a legend, and a way to save the drawing. */
export function Plot(props: PlotProps) {
  const { series } = props;
  const [box, room] = useRoom();
  const width = props.width ?? room;
  const height = props.height ?? Math.max(240, Math.round((width * 4) / 7));
  const drawing = useRef<SVGSVGElement>(null);
  const title = useId();
  const [chosen, choose] = useState<string | null>(null);
  const usable = series.map((one) => ({ ...one, points: one.points.filter((point) => isDrawable(point, props)) }));
  const all = usable.flatMap((one) => one.points);
  const x = axis(props.x, extent(all, (point) => point[0]), [MARGIN.left, width - MARGIN.right]);
  const y = axis(props.y, extent(all, (point) => point[1]), [height - MARGIN.bottom, MARGIN.top]);
  if (x === null || y === null) return <p class="quiet">Nothing to draw.</p>;
  const curve = line<readonly [number, number]>((point) => x(point[0]), (point) => y(point[1]));
  const look = (one: Series, place: number) =>
    `colour-${(one.colour ?? place) % COLOURS}${chosen !== null && chosen !== one.name ? " faint" : ""}`;
  const saveIt = () => drawing.current && saveSvg(drawing.current, props.file!, series.map((one) => one.name));
  return (
    <figure class="plot" ref={box}>
      <svg ref={drawing} viewBox={`0 0 ${width} ${height}`} role="img" aria-labelledby={title}>
        <title id={title}>{props.title}</title>
        <g class="axis">
          {(props.x.ticks ?? ticksOf(x, props.x.log ?? false, 6)).map((tick) => (
            <g key={tick} transform={`translate(${x(tick)}, ${height - MARGIN.bottom})`}>
              <line y2={MARGIN.top + MARGIN.bottom - height} />
              <text y={16} text-anchor="middle">
                {tickName(tick, props.x.log ?? false)}
              </text>
            </g>
          ))}
          {(props.y.ticks ?? ticksOf(y, props.y.log ?? false, 5)).map((tick) => (
            <g key={tick} transform={`translate(${MARGIN.left}, ${y(tick)})`}>
              <line x2={width - MARGIN.left - MARGIN.right} />
              <text x={-8} dy="0.32em" text-anchor="end">
                {tickName(tick, props.y.log ?? false)}
              </text>
            </g>
          ))}
        </g>
        <text class="label" x={(MARGIN.left + width - MARGIN.right) / 2} y={height - 8} text-anchor="middle">
          {props.x.label}
        </text>
        <text class="label" transform={`translate(14, ${(height - MARGIN.bottom) / 2}) rotate(-90)`} text-anchor="middle">
          {props.y.label}
        </text>
        {usable.map((one, place) => (
          <path
            key={one.name}
            class={`curve ${look(one, place)}`}
            d={curve(one.steps ? stepped(one.points) : one.points) ?? ""}
            stroke-dasharray={one.dashed || (one.colour ?? place) >= COLOURS ? "5 3" : undefined}
          />
        ))}
        {usable.map((one, place) =>
          one.dots
            ? one.points.map((point) => (
                <circle
                  key={`${one.name} ${point[0]}`}
                  class={`dot ${look(one, place)}`}
                  cx={x(point[0])}
                  cy={y(point[1])}
                  r={3}
                />
              ))
            : null,
        )}
      </svg>
      <figcaption>
        {(props.legend ?? series.length > 1) && (
          <ul class="legend">
            {series.map((one, place) => (
              <li
                key={one.name}
                onPointerEnter={() => choose(one.name)}
                onPointerLeave={() => choose(null)}
              >
                <i class={`mark colour-${(one.colour ?? place) % COLOURS}`} aria-hidden="true" />
                {one.name}
              </li>
            ))}
          </ul>
        )}
        {props.file && (
          <button type="button" class="plain small" onClick={saveIt}>
            Save as SVG
          </button>
        )}
      </figcaption>
    </figure>
  );
}

/** How wide a drawing can be, so that its letters keep their size on a narrow page. */
function useRoom(): [RefObject<HTMLElement | null>, number] {
  const box = useRef<HTMLElement>(null);
  const [room, setRoom] = useState(WIDTH);
  useLayoutEffect(() => {
    const element = box.current;
    if (!element) return;
    const measure = () => setRoom(Math.min(WIDTH, Math.max(NARROW, Math.round(element.clientWidth))));
    measure();
    const observer = new ResizeObserver(measure);
    observer.observe(element);
    return () => observer.disconnect();
  }, []);
  return [box, room];
}

type Scale = ((value: number) => number) & { ticks: (count?: number) => number[] };

function axis(
  wanted: PlotProps["x"],
  found: [number, number] | [undefined, undefined],
  places: [number, number],
): Scale | null {
  let [low, high] = wanted.range ?? found;
  if (low === undefined || high === undefined) return null;
  if (low === high) [low, high] = wanted.log ? [low / 2, high * 2] : [low - 0.5, high + 0.5];
  return wanted.log ? scaleLog([low, high], places) : scaleLinear([low, high], places).nice();
}

function isDrawable(point: readonly [number, number], props: PlotProps): boolean {
  const [x, y] = point;
  if (!Number.isFinite(x) || !Number.isFinite(y)) return false;
  return (!props.x.log || x > 0) && (!props.y.log || y > 0);
}

/** Corners of the stairs of which the points are left ends. */
function stepped(points: readonly (readonly [number, number])[]): (readonly [number, number])[] {
  return points.flatMap((point, i) => {
    const next = points[i + 1];
    return next === undefined ? [point] : [point, [next[0], point[1]] as const];
  });
}
