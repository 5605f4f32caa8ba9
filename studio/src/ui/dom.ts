/** Elements by one call, and the icons. */

type Child = globalThis.Node | string | null | undefined | false;
type Properties = { [name: string]: unknown };

function fill(element: Element, properties: Properties, children: Child[]): void {
  for (const [name, value] of Object.entries(properties)) {
    if (value === undefined || value === null || value === false) continue;
    if (name.startsWith("on")) element.addEventListener(name.slice(2), value as EventListener);
    else element.setAttribute(name, value === true ? "" : String(value));
  }
  element.append(...children.filter((c): c is globalThis.Node | string => Boolean(c)));
}

export function h<K extends keyof HTMLElementTagNameMap>(
  tag: K,
  properties: Properties = {},
  ...children: Child[]
): HTMLElementTagNameMap[K] {
  const element = document.createElement(tag);
  fill(element, properties, children);
  return element;
}

export function svg<K extends keyof SVGElementTagNameMap>(
  tag: K,
  properties: Properties = {},
  ...children: Child[]
): SVGElementTagNameMap[K] {
  const element = document.createElementNS("http://www.w3.org/2000/svg", tag);
  fill(element, properties, children);
  return element;
}

const PATHS = {
  select: "M5 3l11 7-5 1.2L8.4 16z",
  move: "M10 2.5v15M2.5 10h15M10 2.5L8 5m2-2.5L12 5M10 17.5L8 15m2 2.5l2-2.5M2.5 10L5 8m-2.5 2L5 12m12.5-2L15 8m2.5 2L15 12",
  rotate: "M16.5 10a6.5 6.5 0 1 1-2.2-4.9M14.5 2v3.4h-3.4",
  scale: "M3 17V9.5h7.5V17zM10.5 9.5L17 3m-5 0h5v5",
  measure: "M2.5 13.5l11-11 4 4-11 11zM6 10l1.5 1.5M8.5 7.5L11 10m0-5l1.5 1.5",
  undo: "M7.5 4L4 7.5 7.5 11M4 7.5h8a4 4 0 0 1 0 8H8",
  redo: "M12.5 4L16 7.5 12.5 11M16 7.5H8a4 4 0 0 0 0 8h4",
  eye: "M2 10s3-5 8-5 8 5 8 5-3 5-8 5-8-5-8-5zM10 12.2a2.2 2.2 0 1 0 0-4.4 2.2 2.2 0 0 0 0 4.4z",
  hidden: "M3 3l14 14M8 5.3A8 8 0 0 1 10 5c5 0 8 5 8 5a13 13 0 0 1-2.6 3M5 6.6A13 13 0 0 0 2 10s3 5 8 5a8 8 0 0 0 3-.6",
  lock: "M5.5 9h9v7.5h-9zM7.5 9V6.5a2.5 2.5 0 0 1 5 0V9",
  open: "M5.5 9h9v7.5h-9zM7.5 9V5.5a2.5 2.5 0 0 1 4.9-.8",
  isolate: "M3 6.5V3h3.5M13.5 3H17v3.5M17 13.5V17h-3.5M6.5 17H3v-3.5M10 12.5a2.5 2.5 0 1 0 0-5 2.5 2.5 0 0 0 0 5z",
  add: "M10 4v12M4 10h12",
  copy: "M7 7h9.5v9.5H7zM13 7V3.5H3.5V13H7",
  mirror: "M10 2.5v15M7.5 5.5v9L2.5 14.5zM12.5 5.5v9l5 0z",
  remove: "M4 5.5h12M8 5.5V3.5h4v2M5.5 5.5l.7 11h7.6l.7-11",
  subtract: "M3 3h9v5H8v4H3zM8 8h9v9H8z",
  snap: "M5 3v7a5 5 0 0 0 10 0V3h-3.2v7a1.8 1.8 0 0 1-3.6 0V3zM5 6h3.2m3.6 0H15",
  download: "M10 3v9m0 0L6.5 8.7M10 12l3.5-3.3M3.5 15.5v1.5h13v-1.5",
  theme: "M10 3a7 7 0 1 0 0 14zM10 3a7 7 0 0 1 0 14",
  help: "M7.5 7.8a2.6 2.6 0 1 1 3.7 2.3c-.8.4-1.2.9-1.2 1.9M10 14.6v.4M10 17.5a7.5 7.5 0 1 0 0-15 7.5 7.5 0 0 0 0 15z",
  frame: "M3 7V3h4M13 3h4v4M17 13v4h-4M7 17H3v-4",
  close: "M5 5l10 10M15 5L5 15",
  more: "M4.5 10h.01M10 10h.01M15.5 10h.01",
  chevron: "M7 5l5 5-5 5",
  fit: "M10 2.5l6.5 3.7v7.6L10 17.5l-6.5-3.7V6.2zM3.5 6.2L10 10m0 0l6.5-3.8M10 10v7.5",
  stop: "M5.5 5.5h9v9h-9z",
  layers: "M10 3l7.5 4L10 11 2.5 7zM2.5 10.5l7.5 4 7.5-4M2.5 13.8l7.5 4 7.5-4",
  pattern: "M3 3h4.5v4.5H3zM12.5 3H17v4.5h-4.5zM3 12.5h4.5V17H3zM12.5 12.5H17V17h-4.5z",
} as const;

export type Icon = keyof typeof PATHS;

export function icon(name: Icon): SVGSVGElement {
  const path = svg("path", { d: PATHS[name] });
  return svg("svg", { viewBox: "0 0 20 20", class: "icon", "aria-hidden": "true" }, path);
}
