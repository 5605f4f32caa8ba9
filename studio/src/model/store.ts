/** What the page holds: the assembly and its history, and what of it is selected, hidden and locked. */

import { cutsLearned } from "./learned";
import { paletteColour } from "./palette";
import { type Frame, type Program, compile, unitFrame } from "./program";
import { type Group, type Node, type Part, edited, find, isGroup, leaves } from "./tree";
import type { Box } from "./vectors";

/** As many groups as the shader can keep open. */
const DEEPEST = 16;

export type Event = "document" | "selection" | "hover" | "view" | "history";

export interface Step {
  label: string;
  root: Group;
}

export class Store {
  root: Group;
  frame: Frame;
  program: Program;
  readonly selection = new Set<number>();
  readonly hidden = new Set<number>();
  readonly locked = new Set<number>();
  hovered: number | null = null;
  snapping = false;
  /** Where the document stands that was saved last. */
  /** What the picture has to hold besides the parts, in own units. */
  frameBox: Box | null = null;
  /** Told of each step of the history, for whoever keeps it. */
  onStep: (action: "commit" | "undo" | "redo", label: string) => void = () => {};
  private past: Step[] = [];
  private future: Step[] = [];
  private before: Group | null = null;
  private colours = new Map<number, number>();
  private listeners = new Map<Event, (() => void)[]>();
  private hiddenBefore: Set<number> | null = null;

  constructor(root: Group) {
    this.root = root;
    this.frame = unitFrame(root);
    this.program = compile(root, this.frame, this.hidden);
    this.colourAll();
  }

  on(events: Event[], listener: () => void): void {
    for (const event of events) this.listeners.set(event, [...(this.listeners.get(event) ?? []), listener]);
  }

  private tell(...events: Event[]): void {
    for (const event of events) for (const listener of this.listeners.get(event) ?? []) listener();
  }

  /** The tree with the ids of the present one's parts of the same names: they stay selected, hidden and locked. */
  named(root: Group): Group {
    const ids = new Map([...leaves(this.before ?? this.root)].map((part) => [part.name, part.id]));
    return edited(root, (node) => (isGroup(node) ? node : { ...node, id: ids.get(node.name) ?? node.id })) ?? root;
  }

  /** What somebody else holds: in place of all that is here, the history too. */
  adopt(root: Group, past: Step[], future: Step[]): void {
    this.before = null;
    const named = this.named(root);
    this.past = past;
    this.future = future;
    this.frame = unitFrame(named, this.frameBox);
    this.show(named);
    this.tell("document", "history", "selection", "view");
  }

  /** Another assembly in place of this one: the history stays, so that it can be taken back. */
  open(root: Group, label: string): void {
    const frame = unitFrame(root, this.frameBox);
    this.commit(root, label);
    this.frame = frame;
    this.show(this.root);
    this.tell("document", "view");
  }

  private show(root: Group): void {
    this.root = root;
    const there = new Set([...leaves(root)].map((part) => part.id));
    for (const set of [this.selection, this.hidden, this.locked])
      for (const id of set) if (!there.has(id) && !find(root, id)) set.delete(id);
    if (this.hovered !== null && !find(root, this.hovered)) this.hovered = null;
    this.colourAll();
    this.recompile();
  }

  private recompile(): void {
    this.program = compile(this.root, this.frame, this.hidden);
  }

  /** Shows a change that is still going on: a drag is one step in the end. */
  preview(root: Group): void {
    this.before ??= this.root;
    this.show(root);
    this.tell("document");
  }

  /** Told where a change was refused. */
  onRefused: (text: string) => void = () => {};

  /** Ends what `preview` began, or makes a change at once. */
  commit(root: Group, label: string): void {
    const from = this.before ?? this.root;
    this.before = null;
    if (root === from) {
      this.show(root);
      this.tell("document");
      return;
    }
    this.show(root);
    if (this.program.depth > DEEPEST) {
      this.show(from);
      this.tell("document");
      this.onRefused(`Groups would be nested more than ${DEEPEST - 1} deep, which the page cannot show.`);
      return;
    }
    if (cutsLearned(root)) {
      this.show(from);
      this.tell("document");
      this.onRefused("Learned parts can be joined to others, but neither cut nor taken away.");
      return;
    }
    this.past.push({ label, root: from });
    this.future = [];
    this.onStep("commit", label);
    this.tell("document", "history", "selection");
  }

  cancel(): void {
    if (!this.before) return;
    const root = this.before;
    this.before = null;
    this.show(root);
    this.tell("document");
  }

  get previewing(): boolean {
    return this.before !== null;
  }

  get undoLabel(): string | null {
    return this.past.at(-1)?.label ?? null;
  }

  get redoLabel(): string | null {
    return this.future.at(-1)?.label ?? null;
  }

  undo(): void {
    this.step(this.past, this.future);
  }

  redo(): void {
    this.step(this.future, this.past);
  }

  private step(from: Step[], to: Step[]): void {
    this.cancel();
    const step = from.pop();
    if (!step) return;
    to.push({ label: step.label, root: this.root });
    this.show(step.root);
    this.onStep(from === this.past ? "undo" : "redo", step.label);
    this.tell("document", "history", "selection");
  }

  // Selection

  select(ids: number[], more = false): void {
    if (!more) this.selection.clear();
    for (const id of ids) {
      if (more && this.selection.has(id)) this.selection.delete(id);
      else this.selection.add(id);
    }
    this.tell("selection");
  }

  hover(id: number | null): void {
    if (id === this.hovered) return;
    this.hovered = id;
    this.tell("hover");
  }

  /** The selected nodes, without those inside of a selected group. */
  get selected(): Node[] {
    const result: Node[] = [];
    const walk = (node: Node) => {
      if (this.selection.has(node.id)) result.push(node);
      else if (isGroup(node)) node.children.forEach(walk);
    };
    walk(this.root);
    return result;
  }

  /** The leaves that an edit of the selection changes: not the locked ones. */
  get editable(): Node[] {
    return this.selected.filter((node) => [...leaves(node)].every((part) => !this.locked.has(part.id)));
  }

  get selectedParts(): Part[] {
    return this.selected.flatMap((node) => [...leaves(node)]);
  }

  // View

  toggle(set: Set<number>, ids: number[], on: boolean): void {
    for (const id of ids) {
      if (on) set.add(id);
      else set.delete(id);
    }
    if (set === this.hidden) this.hiddenBefore = null;
    this.recompile();
    this.tell("view");
  }

  get isolating(): boolean {
    return this.hiddenBefore !== null;
  }

  /** Hides all but these parts; asked again, shows what was there before. */
  isolate(ids: number[]): void {
    const before = this.hiddenBefore;
    if (before) {
      this.hidden.clear();
      for (const id of before) this.hidden.add(id);
      this.hiddenBefore = null;
    } else if (ids.length) {
      this.hiddenBefore = new Set(this.hidden);
      const shown = new Set(ids);
      for (const part of leaves(this.root)) if (!shown.has(part.id)) this.hidden.add(part.id);
      for (const id of shown) this.hidden.delete(id);
    }
    this.recompile();
    this.tell("view");
  }

  private colourAll(): void {
    // A new part takes the first colour that none of the others has; those keep theirs.
    const parts = [...leaves(this.root)];
    const taken = new Set(parts.map((part) => this.colours.get(part.id)));
    let next = 0;
    for (const part of parts) {
      if (this.colours.has(part.id)) continue;
      while (taken.has(next)) next++;
      taken.add(next);
      this.colours.set(part.id, next);
    }
  }

  colourOf(part: Part): string {
    const own = part.metadata.colour;
    return typeof own === "string" && /^#[0-9a-f]{6}$/i.test(own) ? own : paletteColour(this.colours.get(part.id) ?? 0);
  }

  // Edits

  /** Each selected node by what `edit` makes of it. */
  change(edit: (node: Node) => Node, label: string, nodes: Node[] = this.editable): void {
    const chosen = new Set(nodes.map((node) => node.id));
    const base = this.before ?? this.root;
    const root = edited(base, (node) => (chosen.has(node.id) ? edit(node) : node));
    if (root) this.commit(root, label);
  }

  /** The longest side in own units. */
  get size(): number {
    return 1.8 / this.frame.scale;
  }
}
