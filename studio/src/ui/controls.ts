/** Number fields, sliders, menus and messages. */

import { formatLength, formatNumber, parseNumber } from "../model/lengths";
import { h, icon, type Icon } from "./dom";

export interface Button {
  icon?: Icon;
  label: string;
  key?: string;
  run: () => void;
}

export function button({ icon: name, label, key, run }: Button, text = false): HTMLButtonElement {
  const title = key ? `${label} (${key})` : label;
  return h("button", { type: "button", title, "aria-label": label, onclick: run }, name && icon(name), (text || !name) && h("span", {}, label));
}

export interface NumberField {
  element: HTMLElement;
  refresh: () => void;
}

interface Numeric {
  label: string;
  title?: string;
  get: () => number;
  /** Shows a value while it is dragged. */
  preview: (value: number) => void;
  commit: (value: number) => void;
  low?: number;
  high?: number;
  /** Of lengths: the assembly's size, which says how many digits matter; of others left out. */
  size?: number;
  digits?: number;
  unit?: string;
}

const shown = (field: Numeric, value: number): string =>
  field.size === undefined ? formatNumber(value, field.digits ?? 3) : formatLength(value, field.size);

/** A number that is typed (sums and fractions too), stepped by the arrow keys, or dragged by its label. */
export function numberField(field: Numeric): NumberField {
  const input = h("input", { type: "text", inputmode: "decimal", "aria-label": field.label, spellcheck: "false", autocomplete: "off" });
  const clamp = (v: number) => Math.max(field.low ?? -Infinity, Math.min(field.high ?? Infinity, v));
  const refresh = () => {
    if (document.activeElement !== input) input.value = shown(field, field.get());
  };
  const take = () => {
    const value = parseNumber(input.value);
    if (value === null) input.value = shown(field, field.get());
    else if (input.value !== shown(field, field.get())) field.commit(clamp(value));
    input.value = shown(field, field.get());
  };
  const step = field.size === undefined ? 10 ** -(field.digits ?? 3) * 10 : field.size / 200;
  input.addEventListener("change", take);
  input.addEventListener("focus", () => input.select());
  input.addEventListener("keydown", (event) => {
    if (event.key === "Enter") {
      take();
      input.select();
    } else if (event.key === "Escape") {
      input.value = shown(field, field.get());
      input.blur();
    } else if (event.key === "ArrowUp" || event.key === "ArrowDown") {
      event.preventDefault();
      const by = step * (event.shiftKey ? 10 : 1) * (event.key === "ArrowUp" ? 1 : -1);
      field.commit(clamp(field.get() + by));
      input.value = shown(field, field.get());
    }
  });
  const label = h("label", { title: field.title ?? `${field.label}: drag to change`, class: "scrub" }, field.label);
  scrub(label, field, step, clamp);
  refresh();
  return { element: h("div", { class: "number" }, label, input, field.unit && h("span", { class: "unit" }, field.unit)), refresh };
}

function scrub(label: HTMLElement, field: Numeric, step: number, clamp: (v: number) => number): void {
  let from: { x: number; value: number; moved: boolean } | null = null;
  label.addEventListener("pointerdown", (event) => {
    from = { x: event.clientX, value: field.get(), moved: false };
    label.setPointerCapture(event.pointerId);
    event.preventDefault();
  });
  label.addEventListener("pointermove", (event) => {
    if (!from) return;
    const by = event.clientX - from.x;
    from.moved ||= Math.abs(by) > 2;
    if (from.moved) field.preview(clamp(from.value + by * step * (event.shiftKey ? 0.1 : 0.5)));
  });
  const end = () => {
    if (from?.moved) field.commit(field.get());
    from = null;
  };
  label.addEventListener("pointerup", end);
  label.addEventListener("pointercancel", end);
}

/** A slider with a number field beside it. Of a length it goes to twice what it is. */
export function slider(field: Numeric): NumberField {
  const low = field.low ?? 0;
  let high = field.high ?? 1;
  const range = h("input", { type: "range", min: 0, max: 1000, step: 1, "aria-label": field.label });
  const number = numberField(field);
  let dragging = false;
  const reach = () => {
    if (field.size !== undefined) high = Math.max(2 * field.get(), field.size / 20);
  };
  reach();
  const refresh = () => {
    number.refresh();
    if (dragging) return;
    if (field.get() > high) reach();
    range.value = String(Math.round(((field.get() - low) / (high - low)) * 1000));
    range.style.setProperty("--share", `${Number(range.value) / 10}%`);
  };
  const value = () => low + (Number(range.value) / 1000) * (high - low);
  range.addEventListener("input", () => {
    dragging = true;
    range.style.setProperty("--share", `${Number(range.value) / 10}%`);
    field.preview(value());
  });
  range.addEventListener("change", () => {
    dragging = false;
    field.commit(value());
    reach();
    refresh();
  });
  refresh();
  return { element: h("div", { class: "slider" }, number.element, range), refresh };
}

/** A button that opens a list of choices below it. */
export function menu(label: string, name: Icon, choices: () => (Button | null)[], text = true): HTMLElement {
  const list = h("div", { class: "menu", role: "menu", hidden: true });
  const opener = h("button", { type: "button", title: label, "aria-label": label, "aria-haspopup": "menu" }, icon(name), text && h("span", {}, label));
  const close = () => {
    list.hidden = true;
    opener.setAttribute("aria-expanded", "false");
    document.removeEventListener("pointerdown", outside, true);
  };
  const outside = (event: globalThis.Event) => {
    if (!holder.contains(event.target as globalThis.Node)) close();
  };
  opener.addEventListener("click", () => {
    if (!list.hidden) return close();
    list.replaceChildren(
      ...choices().map((choice) =>
        choice
          ? h("button", { type: "button", role: "menuitem", onclick: () => (close(), choice.run()) }, choice.icon && icon(choice.icon), h("span", {}, choice.label), choice.key && h("kbd", {}, choice.key))
          : h("hr"),
      ),
    );
    list.hidden = false;
    opener.setAttribute("aria-expanded", "true");
    list.style.left = "0";
    const over = list.getBoundingClientRect().right - window.innerWidth + 8;
    if (over > 0) list.style.left = `${-over}px`;
    list.querySelector("button")?.focus();
    document.addEventListener("pointerdown", outside, true);
  });
  list.addEventListener("keydown", (event) => {
    const items = [...list.querySelectorAll("button")];
    const at = items.indexOf(document.activeElement as HTMLButtonElement);
    if (event.key === "Escape") {
      close();
      opener.focus();
    } else if (event.key === "ArrowDown") items[(at + 1) % items.length]?.focus();
    else if (event.key === "ArrowUp") items[(at + items.length - 1) % items.length]?.focus();
    else return;
    event.preventDefault();
    event.stopPropagation();
  });
  const holder = h("div", { class: "menu-holder" }, opener, list);
  return holder;
}

/** A message for some seconds; with a button where there is something to do about it. */
export function toast(text: string, action?: Button, error = false): void {
  let holder = document.querySelector(".toasts");
  if (!holder) document.body.append((holder = h("div", { class: "toasts", role: "status", "aria-live": "polite" })));
  const message = h("div", { class: error ? "toast error" : "toast" }, h("span", {}, text));
  const close = () => message.remove();
  if (action) message.append(h("button", { type: "button", onclick: () => (close(), action.run()) }, action.label));
  message.append(h("button", { type: "button", class: "close", "aria-label": "Close", onclick: close }, icon("close")));
  holder.append(message);
  setTimeout(close, error || action ? 12000 : 5000);
}

/** What a file leaves out that was just saved: the maps of so many parts. */
export function tellOfMaps(bare: number): void {
  if (bare) toast(`Without the ${bare === 1 ? "map of one part" : `maps of ${bare} parts`}: the format holds none. The assembly file does.`);
}

export function save(data: BlobPart, type: string, name: string): void {
  const url = URL.createObjectURL(new Blob([data], { type }));
  const link = h("a", { href: url, download: name });
  document.body.append(link);
  link.click();
  link.remove();
  setTimeout(() => URL.revokeObjectURL(url), 60_000);
}
