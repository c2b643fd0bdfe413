// Files that the page makes: drawings, tables, pictures.

const SVG = "http://www.w3.org/2000/svg";
const DRAWN = ["fill", "stroke", "stroke-width", "stroke-dasharray", "stroke-opacity", "opacity", "font-family", "font-size"];

/** Hand a file to the person. */
export function save(content: Blob, name: string): void {
  const url = URL.createObjectURL(content);
  const link = document.createElement("a");
  link.href = url;
  link.download = name;
  link.click();
  window.setTimeout(() => URL.revokeObjectURL(url), 10_000);
}

const LINE = 20; // pixels of an entry of the legend

/** A drawing with the style that it has on the page, and its curves' names, written into it: it stands alone. */
export function saveSvg(drawing: SVGSVGElement, name: string, curves: readonly string[] = []): void {
  const copy = drawing.cloneNode(true) as SVGSVGElement;
  const originals = [drawing, ...drawing.querySelectorAll("*")];
  [copy, ...copy.querySelectorAll("*")].forEach((element, i) => {
    const style = getComputedStyle(originals[i]!);
    for (const property of DRAWN) element.setAttribute(property, style.getPropertyValue(property));
    element.removeAttribute("class");
  });
  if (curves.length > 1) addLegend(copy, drawing, curves);
  copy.setAttribute("xmlns", SVG);
  const text = new XMLSerializer().serializeToString(copy);
  save(new Blob([text], { type: "image/svg+xml" }), name);
}

/** Write the names of curves below a drawing, each with a piece of its curve. */
function addLegend(copy: SVGSVGElement, drawing: SVGSVGElement, names: readonly string[]): void {
  const { width, height } = drawing.viewBox.baseVal;
  copy.setAttribute("viewBox", `0 0 ${width} ${height + LINE * names.length + 8}`);
  const ink = getComputedStyle(drawing).color;
  drawing.querySelectorAll(".curve").forEach((curve, i) => {
    const { stroke, strokeDasharray } = getComputedStyle(curve);
    const y = height + LINE * (i + 0.5);
    const piece = { d: `M60 ${y}h24`, stroke, "stroke-width": "2", "stroke-dasharray": strokeDasharray };
    append(copy, "path", piece);
    append(copy, "text", { x: "92", y: String(y + 4), fill: ink, "font-size": "12" }).textContent = names[i] ?? "";
  });
}

function append(parent: Element, tag: string, attributes: Record<string, string>): Element {
  const element = document.createElementNS(SVG, tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  return parent.appendChild(element);
}

/** Rows as a table that spreadsheets read. */
export function saveCsv(rows: readonly (readonly (string | number | null)[])[], name: string): void {
  const text = rows.map((row) => row.map(quoted).join(",")).join("\r\n");
  save(new Blob([text, "\r\n"], { type: "text/csv" }), name);
}

function quoted(value: string | number | null): string {
  const text = value === null ? "" : String(value);
  const harmless = typeof value === "string" && /^[=+\-@]/.test(text) ? `'${text}` : text; // no formulas
  return /[",\r\n]/.test(harmless) ? `"${harmless.replaceAll('"', '""')}"` : harmless;
}
