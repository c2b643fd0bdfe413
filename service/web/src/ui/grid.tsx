// A grid of which only what is seen exists, so that ten thousand shapes scroll smoothly.

import type { ComponentChildren } from "preact";
import { useEffect, useLayoutEffect, useRef, useState } from "preact/hooks";

interface Props<Item> {
  items: readonly Item[];
  /** How many there will be, as far as it is known. */
  total: number;
  keyOf: (item: Item) => string;
  /** Least width and exact height of a cell, pixels. */
  cell: { width: number; height: number };
  label: string;
  children: (item: Item, position: number) => ComponentChildren;
  /** What stands after the last item that is there is seen: load it. */
  more: () => void;
  /** Told which positions are seen, from the first to before the last. */
  seen?: (first: number, last: number) => void;
}

const GAP = 12;
const BEYOND = 3; // rows above and below the window

/** Cells in as many columns as fit, scrolled with the page. */
export function Grid<Item>(props: Props<Item>) {
  const { items, total, cell } = props;
  const box = useRef<HTMLDivElement>(null);
  const [width, setWidth] = useState(0);
  const [seen, setSeen] = useState({ top: 0, height: 800 });
  const columns = Math.max(1, Math.floor((width + GAP) / (cell.width + GAP)));
  const rowHeight = cell.height + GAP;
  const rows = Math.ceil(Math.max(total, items.length) / columns);

  useLayoutEffect(() => {
    const element = box.current;
    if (!element) return;
    const measure = () => setWidth(element.clientWidth);
    measure();
    const observer = new ResizeObserver(measure);
    observer.observe(element);
    return () => observer.disconnect();
  }, []);

  useEffect(() => {
    let frame = 0;
    const look = () => {
      frame = 0;
      const top = box.current ? -box.current.getBoundingClientRect().top : 0;
      setSeen((before) =>
        Math.abs(before.top - top) < rowHeight / 2 && before.height === window.innerHeight
          ? before
          : { top, height: window.innerHeight },
      );
    };
    const soon = () => (frame ||= requestAnimationFrame(look));
    look();
    addEventListener("scroll", soon, { passive: true });
    addEventListener("resize", soon);
    return () => {
      cancelAnimationFrame(frame);
      removeEventListener("scroll", soon);
      removeEventListener("resize", soon);
    };
  }, [rowHeight]);

  const first = Math.max(0, Math.floor(seen.top / rowHeight) - BEYOND) * columns;
  const last = Math.min(rows, Math.ceil((seen.top + seen.height) / rowHeight) + BEYOND) * columns;
  const isShort = last > items.length && items.length < total;
  useEffect(() => {
    if (isShort) props.more();
  }, [isShort, items.length]);

  useEffect(() => props.seen?.(first, last), [first, last]);

  const shown = width === 0 ? [] : Array.from({ length: Math.max(0, Math.min(last, Math.max(total, items.length)) - first) });
  return (
    <div ref={box} class="grid" role="list" aria-label={props.label} style={{ height: `${Math.max(0, rows * rowHeight - GAP)}px` }}>
      {shown.map((_, offset) => {
        const position = first + offset;
        const item = items[position];
        const column = position % columns;
        const size = (width - GAP * (columns - 1)) / columns;
        const place = {
          width: `${size}px`,
          height: `${cell.height}px`,
          transform: `translate(${column * (size + GAP)}px, ${Math.floor(position / columns) * rowHeight}px)`,
        };
        return (
          <div
            key={item === undefined ? `empty ${position}` : props.keyOf(item)}
            class="cell"
            role="listitem"
            aria-posinset={position + 1}
            aria-setsize={Math.max(total, items.length)}
            style={place}
          >
            {item === undefined ? <span class="card waiting" aria-hidden="true" /> : props.children(item, position)}
          </div>
        );
      })}
    </div>
  );
}
