// Numbers and times as people say them.

const COUNT = new Intl.NumberFormat("en");

export function count(value: number, one: string, many = `${one}s`): string {
  return `${COUNT.format(value)} ${value === 1 ? one : many}`;
}

export function grouped(value: number): string {
  return COUNT.format(value);
}

/** 0.973 as "97 %", close to the ends with a decimal. */
export function share(value: number): string {
  const percent = 100 * value;
  const digits = percent > 99 && percent < 100 ? 1 : 0;
  return `${(digits ? Math.floor(10 * percent) / 10 : percent).toFixed(digits)} %`;
}

/** Three digits that count. */
export function brief(value: number): string {
  if (value === 0) return "0";
  const size = Math.abs(value);
  return size >= 1e5 || size < 1e-3 ? value.toExponential(1) : Number(value.toPrecision(3)).toString();
}

export function bytes(value: number): string {
  if (value < 1024) return `${value} B`;
  const [amount, unit] = value < 1024 ** 2 ? [value / 1024, "kB"] : [value / 1024 ** 2, "MB"];
  return `${amount < 10 ? amount.toFixed(1) : Math.round(amount)} ${unit}`;
}

/** "3 minutes ago", the whole time as a title where it matters. */
export function ago(time: string, now = Date.now()): string {
  const seconds = Math.max(0, (now - Date.parse(time)) / 1000);
  if (seconds < 45) return "just now";
  const steps: [number, string][] = [
    [60, "minute"],
    [3600, "hour"],
    [86400, "day"],
    [30 * 86400, "month"],
    [365 * 86400, "year"],
  ];
  const [unit, name] = [...steps].reverse().find(([length]) => seconds >= 0.75 * length) ?? steps[0]!;
  return `${count(Math.round(seconds / unit), name)} ago`;
}

export function duration(from: string, to: string | null, now = Date.now()): string {
  const seconds = Math.max(0, ((to === null ? now : Date.parse(to)) - Date.parse(from)) / 1000);
  if (seconds < 60) return `${seconds < 10 ? seconds.toFixed(1) : Math.round(seconds)} s`;
  const minutes = Math.floor(seconds / 60);
  return minutes < 60 ? `${minutes} min ${Math.round(seconds % 60)} s` : `${Math.floor(minutes / 60)} h ${minutes % 60} min`;
}

/** A time that was estimated: "about 40 s", "about 3 min", "about 2 h". */
export function about(seconds: number): string {
  if (seconds < 90) return `about ${Math.max(1, Math.round(seconds))} s`;
  const minutes = seconds / 60;
  return minutes < 90 ? `about ${Math.round(minutes)} min` : `about ${Math.round(minutes / 60)} h`;
}

/** "cat/cat-01.ply" of a stored name, without its folders. */
export function fileName(name: string): string {
  return name.split("/").pop() ?? name;
}

/** The folders of a path from the first on, each with all before it: "a", "a/b" of "a/b/cat.ply". */
export function foldersOf(path: string): string[] {
  const parts = path.split("/").slice(0, -1);
  return parts.map((_, i) => parts.slice(0, i + 1).join("/"));
}

/** The last two parts of a path, which say most. */
export function shortPath(path: string): string {
  const parts = path.split("/");
  return parts.length > 2 ? `…/${parts.slice(-2).join("/")}` : path;
}
