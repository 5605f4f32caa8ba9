/** The list of parts: what there is, shown or hidden, locked or free, in which colour. */

import type { Store } from "../model/store";
import { type Group, type Node, type Part, edited, isGroup, leaves } from "../model/tree";
import { h, icon } from "./dom";
import { toast } from "./controls";

const WORDS = { union: "Together", difference: "Minus", intersection: "Shared" };

export class PartList {
  readonly element = h("div", { class: "part-list", role: "tree", "aria-label": "Parts", "aria-multiselectable": "true" });
  private rows = new Map<number, HTMLElement>();
  private closed = new Set<number>();
  private shape = "";
  private lastClicked: number | null = null;

  constructor(private store: Store) {
    store.on(["document", "view"], () => this.draw());
    store.on(["selection", "hover"], () => this.mark());
    this.draw();
  }

  private draw(): void {
    // Numbers change many times a second in a drag; the list only with what it shows.
    const { store } = this;
    const shape = JSON.stringify([
      [...nodesOf(store.root)].map((n) => [n.id, n.name, isGroup(n) ? n.operation : store.colourOf(n), isGroup(n) ? 0 : n.instances.length]),
      [...store.hidden],
      [...store.locked],
      [...this.closed],
    ]);
    if (shape === this.shape) return;
    this.shape = shape;
    this.rows.clear();
    const rows: HTMLElement[] = [];
    const walk = (node: Node, depth: number, parent: Group | null, index: number) => {
      const sign = parent?.operation === "difference" && index > 0 ? "−" : parent?.operation === "intersection" && index > 0 ? "∩" : "";
      const row = isGroup(node) ? this.groupRow(node, depth, sign) : this.partRow(node, depth, sign);
      this.rows.set(node.id, row);
      rows.push(row);
      if (isGroup(node) && !this.closed.has(node.id)) node.children.forEach((c, i) => walk(c, depth + 1, node, i));
    };
    // A plain union needs no heading.
    const { root } = store;
    if (root.operation === "union") root.children.forEach((c, i) => walk(c, 0, root, i));
    else walk(root, 0, null, 0);
    const scroll = this.element.scrollTop;
    this.element.replaceChildren(...rows);
    this.element.scrollTop = scroll;
    this.mark();
  }

  private mark(): void {
    for (const [id, row] of this.rows) {
      row.classList.toggle("hovered", id === this.store.hovered);
      row.setAttribute("aria-selected", String(this.store.selection.has(id)));
    }
  }

  private switches(node: Node): HTMLElement[] {
    const { store } = this;
    const ids = [...leaves(node)].map((part) => part.id);
    const hidden = ids.every((id) => store.hidden.has(id));
    const locked = ids.every((id) => store.locked.has(id));
    const flip = (set: Set<number>, on: boolean) => (event: Event) => {
      event.stopPropagation();
      store.toggle(set, ids, on);
    };
    const name = node.name || (isGroup(node) ? WORDS[node.operation] : "part");
    return [
      h("button", { type: "button", class: locked ? "on" : "", title: locked ? "Unlock" : "Lock: neither edits nor refits change it", "aria-label": `${locked ? "Unlock" : "Lock"} ${name}`, "aria-pressed": String(locked), onclick: flip(store.locked, !locked) }, icon(locked ? "lock" : "open")),
      h("button", { type: "button", class: hidden ? "on" : "", title: hidden ? "Show" : "Hide", "aria-label": `${hidden ? "Show" : "Hide"} ${name}`, "aria-pressed": String(hidden), onclick: flip(store.hidden, !hidden) }, icon(hidden ? "hidden" : "eye")),
    ];
  }

  private row(node: Node, depth: number, ...content: HTMLElement[]): HTMLElement {
    const { store } = this;
    const hidden = [...leaves(node)].every((part) => store.hidden.has(part.id));
    const row = h(
      "div",
      { class: `row${isGroup(node) ? " group" : ""}${hidden ? " dim" : ""}`, role: "treeitem", tabindex: "0", style: `--depth:${depth}`, "data-name": node.name },
      ...content,
      h("span", { class: "switches" }, ...this.switches(node)),
    );
    row.addEventListener("click", (event) => this.click(node, event));
    row.addEventListener("dblclick", () => !isGroup(node) && this.rename(node, row));
    row.addEventListener("pointerenter", () => store.hover(isGroup(node) ? null : node.id));
    row.addEventListener("pointerleave", () => store.hover(null));
    row.addEventListener("keydown", (event) => {
      if (event.target !== row) return;
      if (event.key === "Enter") this.click(node, event);
      else if (event.key === "F2" && !isGroup(node)) this.rename(node, row);
      else if (event.key === "ArrowDown") (row.nextElementSibling as HTMLElement | null)?.focus();
      else if (event.key === "ArrowUp") (row.previousElementSibling as HTMLElement | null)?.focus();
      else return;
      event.preventDefault();
      event.stopPropagation();
    });
    return row;
  }

  private partRow(part: Part, depth: number, sign: string): HTMLElement {
    const { store } = this;
    const colour = h("input", { type: "color", value: store.colourOf(part), title: "Colour", "aria-label": `Colour of ${part.name}` });
    colour.addEventListener("click", (event) => event.stopPropagation());
    const paint = (node: Node): Node => ({ ...node, metadata: { ...node.metadata, colour: colour.value } });
    const repaint = () => edited(store.root, (node) => (node.id === part.id ? paint(node) : node))!;
    colour.addEventListener("input", () => store.preview(repaint()));
    colour.addEventListener("change", () => store.commit(repaint(), `Colour ${part.name}`));
    const copies = part.instances.length ? ` ×${part.instances.length + 1}` : "";
    const name = h("span", { class: "name" }, part.name);
    return this.row(part, depth, colour, h("span", { class: "sign" }, sign), name, h("span", { class: "kind" }, part.field.kind.replace("_", " ") + copies));
  }

  private groupRow(group: Group, depth: number, sign: string): HTMLElement {
    const closed = this.closed.has(group.id);
    const toggle = h("button", { type: "button", class: closed ? "fold" : "fold open", "aria-label": closed ? "Unfold" : "Fold" }, icon("chevron"));
    toggle.addEventListener("click", (event) => {
      event.stopPropagation();
      if (closed) this.closed.delete(group.id);
      else this.closed.add(group.id);
      this.draw();
    });
    const name = h("span", { class: "name" }, group.name || WORDS[group.operation]);
    return this.row(group, depth, toggle, h("span", { class: "sign" }, sign), name, h("span", { class: "kind" }, `${[...leaves(group)].length} parts`));
  }

  private click(node: Node, event: MouseEvent | KeyboardEvent): void {
    const { store } = this;
    const order = [...this.rows.keys()];
    if (event.shiftKey && this.lastClicked !== null && order.includes(this.lastClicked)) {
      const [a, b] = [order.indexOf(this.lastClicked), order.indexOf(node.id)].sort((x, y) => x - y);
      store.select(order.slice(a, b + 1));
      return;
    }
    this.lastClicked = node.id;
    store.select([node.id], event.ctrlKey || event.metaKey);
  }

  private rename(part: Part, row: HTMLElement): void {
    const input = h("input", { type: "text", value: part.name, class: "rename", maxlength: 200, "aria-label": "Name" });
    let over = false;
    const end = (keep: boolean) => {
      if (over) return;
      over = true;
      this.shape = "";
      if (keep) rename(this.store, part, input.value);
      this.draw();
    };
    input.addEventListener("click", (event) => event.stopPropagation());
    input.addEventListener("keydown", (event) => {
      event.stopPropagation();
      if (event.key === "Enter") end(true);
      if (event.key === "Escape") end(false);
    });
    input.addEventListener("blur", () => end(true));
    row.querySelector(".name")!.replaceChildren(input);
    input.focus();
    input.select();
  }
}

export function rename(store: Store, part: Part, wanted: string): void {
  const name = wanted.trim();
  if (!name || name === part.name) return;
  if ([...leaves(store.root)].some((other) => other.name === name && other.id !== part.id)) {
    toast(`Another part is named ${name} already.`, undefined, true);
    return;
  }
  store.change((node) => ({ ...node, name }), `Rename ${part.name}`, [part]);
}

function* nodesOf(node: Node): Generator<Node> {
  yield node;
  if (isGroup(node)) for (const child of node.children) yield* nodesOf(child);
}
