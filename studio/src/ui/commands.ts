/** Everything that a key or a button does, in one table: the help lists it. */

import type { Mode } from "../edit/transform";
import { drilled, duplicated, grouped, mirrorCopies, roleOf, separated, withNew, withRole, without } from "../model/edits";
import { isLearned } from "../model/learned";
import { fromUnit } from "../model/program";
import type { Store } from "../model/store";
import { roundDown } from "../model/lengths";
import { isGroup, type Node, type Operation, type Part, leaves } from "../model/tree";
import { toast } from "./controls";
import type { Tool, Viewport } from "./viewport";

interface Command {
  keys: string[];
  label: string;
  run: () => void;
}

export class Commands {
  readonly table: Record<string, Command>;

  constructor(
    private store: Store,
    private viewport: Viewport,
  ) {
    const tool = (name: Tool) => () => viewport.setTool(name);
    const transform = (mode: Mode) => () => viewport.beginTransform(mode);
    this.table = {
      undo: { keys: ["Ctrl Z"], label: "Undo", run: () => this.undo() },
      redo: { keys: ["Ctrl Shift Z", "Ctrl Y"], label: "Redo", run: () => this.redo() },
      grab: { keys: ["G"], label: "Move; then X, Y or Z for an axis, numbers for a length, Enter to keep, Esc to leave", run: transform("move") },
      turn: { keys: ["R"], label: "Rotate; then X, Y or Z, and degrees", run: transform("rotate") },
      size: { keys: ["S"], label: "Scale; X, Y or Z stretches along the part's own axis", run: transform("scale") },
      duplicate: { keys: ["Shift D"], label: "Duplicate, and move the copy", run: () => this.duplicate() },
      delete: { keys: ["Delete", "Backspace", "X"], label: "Delete", run: () => this.remove() },
      subtract: { keys: ["-"], label: "Take away from the rest, or add again", run: () => this.subtract() },
      isolate: { keys: ["I", "/"], label: "Isolate what is selected, and back", run: () => this.isolate() },
      hide: { keys: ["H"], label: "Hide", run: () => this.flip(store.hidden) },
      show: { keys: ["Alt H"], label: "Show all", run: () => store.toggle(store.hidden, [...store.hidden], false) },
      lock: { keys: ["L"], label: "Lock or unlock", run: () => this.flip(store.locked) },
      all: { keys: ["A", "Ctrl A"], label: "Select all", run: () => store.select([...leaves(store.root)].map((part) => part.id)) },
      none: { keys: ["Escape"], label: "Select nothing", run: () => this.escape() },
      frame: { keys: ["F", "."], label: "Look at what is selected, or at all", run: () => viewport.frameAll() },
      front: { keys: ["1"], label: "View from the front", run: () => viewport.lookFrom(0, 0) },
      side: { keys: ["3"], label: "View from the right", run: () => viewport.lookFrom(90, 0) },
      top: { keys: ["7"], label: "View from above", run: () => viewport.lookFrom(0, 89.5) },
      snap: { keys: ["Shift Tab"], label: "Snap to round places, 15° and tenths; Ctrl while dragging does the other", run: () => this.snap() },
      "tool-select": { keys: ["Q"], label: "Tool: select", run: tool("select") },
      "tool-move": { keys: ["W"], label: "Tool: move by handles", run: tool("move") },
      "tool-rotate": { keys: ["E"], label: "Tool: rotate by handles", run: tool("rotate") },
      "tool-scale": { keys: ["T"], label: "Tool: scale by handles", run: tool("scale") },
      "tool-measure": { keys: ["M"], label: "Tool: measure", run: tool("measure") },
    };
    // What is being moved hears keys first, wherever the focus is.
    const moving = (event: KeyboardEvent) => {
      if (!viewport.dragging.key(event)) return;
      event.preventDefault();
      event.stopPropagation();
    };
    document.addEventListener("keydown", moving, { capture: true });
    document.addEventListener("keydown", (event) => this.key(event));
  }

  onSnap: () => void = () => {};

  run(name: string): void {
    this.table[name].run();
  }

  private key(event: KeyboardEvent): void {
    const target = event.target as HTMLElement;
    const typing = target.matches("input:not([type=range]):not([type=color]), select, textarea");
    const name = keyName(event);
    if (typing && !["Ctrl Z", "Ctrl Shift Z", "Ctrl Y"].includes(name)) return;
    if (typing && (target as HTMLInputElement).type === "text" && name === "Ctrl Z" && target.classList.contains("rename")) return;
    if (document.querySelector("dialog[open]")) return;
    if (target.matches("input[type=range]") && !name.startsWith("Ctrl")) return;
    const found = Object.values(this.table).find((command) => command.keys.includes(name));
    if (!found) return;
    event.preventDefault();
    found.run();
  }

  private undo(): void {
    const label = this.store.undoLabel;
    this.store.undo();
    this.viewport.onStatus(label ? `Undone: ${label}` : "Nothing to undo.");
  }

  private redo(): void {
    const label = this.store.redoLabel;
    this.store.redo();
    this.viewport.onStatus(label ? `Done again: ${label}` : "Nothing to do again.");
  }

  private escape(): void {
    if (this.viewport.forgetClick()) return;
    if (this.viewport.region.active) this.viewport.region.end();
    else if (this.viewport.tool === "measure" && this.viewport.measurements.length) this.viewport.clearMeasurements();
    else if (this.viewport.tool === "measure") this.viewport.setTool("select");
    else this.store.select([]);
  }

  private snap(): void {
    this.store.snapping = !this.store.snapping;
    this.onSnap();
  }

  private get chosen(): Node[] {
    const { editable, selection } = this.store;
    if (!editable.length) toast(selection.size ? "What is selected is locked." : "Select a part first: click it.");
    return editable;
  }

  private duplicate(): void {
    const nodes = this.chosen;
    if (!nodes.length) return;
    const { root, made } = duplicated(this.store.root, nodes);
    this.store.commit(root, "Duplicate");
    this.store.select(made.map((node) => node.id));
    this.viewport.beginTransform("move");
  }

  mirror(axis: number): void {
    const nodes = this.chosen;
    if (!nodes.length) return;
    const { store } = this;
    if (nodes.some((node) => [...leaves(node)].some(isLearned))) return toast("A learned part cannot be mirrored: its model knows it one way round.");
    const middle = fromUnit(store.frame, [0, 0, 0])[axis];
    const { root, made } = mirrorCopies(store.root, nodes, axis, middle);
    store.commit(root, `Mirror across ${"XYZ"[axis]}`);
    store.select(made.map((node) => node.id));
  }

  private remove(): void {
    const nodes = this.chosen;
    if (!nodes.length) return;
    const root = without(this.store.root, new Set(nodes.map((node) => node.id)));
    if (!root) {
      toast("An assembly needs at least one part, so the last one stays.", undefined, true);
      return;
    }
    const only = nodes.length === 1 && !isGroup(nodes[0]) ? nodes[0] : null;
    if (only?.instances.length)
      toast(`${only.name} was there ${only.instances.length + 1} times, and all are deleted.`, {
        label: "Keep the others",
        run: () => {
          this.store.undo();
          this.separate(only);
          toast("Now each is a part of its own: delete the one you mean.");
        },
      });
    this.store.commit(root, nodes.length === 1 ? `Delete ${nodes[0].name || "group"}` : `Delete ${nodes.length} parts`);
  }

  private subtract(): void {
    const nodes = this.chosen;
    if (!nodes.length) return;
    const cut = nodes.every((node) => roleOf(this.store.root, node) === "difference");
    this.role(cut ? "union" : "difference");
  }

  /** The copies of a repeated part as parts of their own. */
  separate(part: Part): void {
    const { root, made } = separated(this.store.root, part);
    this.store.commit(root, `Separate ${part.name}`);
    this.store.select(made.map((one) => one.id));
  }

  /** A hole straight in where the picture is clicked next, as deep as the material is there. */
  hole(): void {
    const { store, viewport } = this;
    viewport.clickOnce("Click where the hole goes: it goes straight in, through what is there.", (hit, depth) => {
      const radius = roundDown(store.size / 30);
      const made = drilled(store.root, fromUnit(store.frame, hit.point), hit.normal, radius, (depth ?? store.size) * 1.02 + store.size / 200);
      if (!made) return toast("There is nothing to drill.");
      store.commit(made.root, "Drill a hole");
      store.select([made.part.id]);
    });
  }

  role(role: Operation): void {
    const nodes = this.chosen;
    if (!nodes.length) return;
    const root = withRole(this.store.root, nodes, role);
    if (!root) {
      toast("Nothing would be left to take it away from.", undefined, true);
      return;
    }
    this.store.commit(root, { union: "Add again", difference: "Take away", intersection: "Keep what is shared" }[role]);
    this.store.select(nodes.map((node) => node.id));
  }

  group(operation: Operation): void {
    const nodes = this.chosen;
    if (nodes.length < 2) return;
    const made = grouped(this.store.root, nodes, operation);
    if (!made) {
      toast("These cannot be a group: nothing would be left around them.", undefined, true);
      return;
    }
    this.store.commit(made.root, "Group");
    this.store.select([made.group.id]);
  }

  add(kind: string): void {
    const { store, viewport } = this;
    // Where the picture's middle shows the surface, so that it is seen at once.
    const place = viewport.middleHit()?.point ?? viewport.camera.target;
    const { root, part } = withNew(store.root, kind, store.size, fromUnit(store.frame, place));
    store.commit(root, `Add ${part.name}`);
    store.select([part.id]);
    viewport.setTool("move");
  }

  private isolate(): void {
    const { store } = this;
    if (!store.isolating && !store.selection.size) toast("Select what to isolate first.");
    store.isolate(store.selectedParts.map((part) => part.id));
  }

  private flip(set: Set<number>): void {
    const { store } = this;
    const ids = store.selectedParts.map((part) => part.id);
    if (!ids.length) toast("Select a part first: click it.");
    store.toggle(set, ids, !ids.every((id) => set.has(id)));
  }
}

/** "Ctrl Shift Z": as the table and the help write it. */
function keyName(event: KeyboardEvent): string {
  const key = event.key.length === 1 ? event.key.toUpperCase() : event.key;
  const shift = event.shiftKey && (key.length > 1 || /[A-Z]/.test(key));
  return [event.ctrlKey || event.metaKey ? "Ctrl" : "", event.altKey ? "Alt" : "", shift ? "Shift" : "", key].filter(Boolean).join(" ");
}
