/** Moving, turning and scaling what is selected: by handles, or by G, R and S with X, Y, Z and typed numbers. */

import { parseNumber, formatLength, formatNumber, roundDown } from "../model/lengths";
import { partBox } from "../model/program";
import type { Store } from "../model/store";
import { type Group, type Node, type Part, isGroup, leaves, moved } from "../model/tree";
import { stretched } from "../model/edits";
import {
  type Quat,
  type Vec3,
  aboutAxis,
  add,
  dot,
  EMPTY,
  isFinite3,
  joinBoxes,
  matrix,
  middle,
  mul,
  NO_ROTATION,
  sub,
} from "../model/vectors";

export type Mode = "move" | "rotate" | "scale";
export type Axis = 0 | 1 | 2;

const VERB = { move: "Move", rotate: "Rotate", scale: "Scale" };

export class Transform {
  readonly nodes: Node[];
  readonly pivot: Vec3;
  axis: Axis | null;
  /** A plane's normal: moves keep to the plane. */
  plane: Axis | null = null;
  local: boolean;
  typed = "";
  private amount: Vec3 = [0, 0, 0]; // of a move; angles and factors are in [0]
  readonly frame: Quat;
  private readonly root: Group;

  constructor(
    private store: Store,
    readonly mode: Mode,
    axis: Axis | null = null,
    local = false,
  ) {
    this.root = store.root;
    this.nodes = store.editable;
    this.pivot = pivotOf(this.nodes);
    this.axis = axis;
    const only = this.nodes.length === 1 && !isGroup(this.nodes[0]) ? (this.nodes[0] as Part) : null;
    this.frame = only?.rotation ?? NO_ROTATION;
    this.local = local && only !== null;
    this.amount = mode === "scale" ? [1, 1, 1] : [0, 0, 0];
  }

  get possible(): boolean {
    return this.nodes.length > 0;
  }

  /** Another press of the same axis turns to the part's own, and a third one frees it. */
  constrain(axis: Axis, plane = false): void {
    const now = plane ? this.plane : this.axis;
    if (now !== axis) {
      this.local = this.mode === "scale";
      [this.axis, this.plane] = plane ? [null, axis] : [axis, null];
    } else if (!this.local && this.single) {
      this.local = true;
    } else {
      this.axis = this.plane = null;
      this.local = false;
    }
    this.show();
  }

  private get single(): boolean {
    return this.nodes.length === 1 && !isGroup(this.nodes[0]);
  }

  /** World direction of an axis as it is constrained. */
  direction(axis: Axis): Vec3 {
    if (!this.local) return [0, 1, 2].map((i) => (i === axis ? 1 : 0)) as Vec3;
    const m = matrix(this.frame);
    return [m[0][axis], m[1][axis], m[2][axis]];
  }

  /** By a world vector for moves, radians in [0] for turns, a factor in [0] for scales. */
  by(amount: Vec3, viewAxis: Vec3, snap: boolean): void {
    this.viewAxis = viewAxis;
    this.amount = snap ? this.snapped(amount) : amount;
    this.show();
  }

  private viewAxis: Vec3 = [0, 0, 1];

  private snapped(amount: Vec3): Vec3 {
    if (this.mode === "rotate") return [snapTo(amount[0], Math.PI / 12), 0, 0];
    if (this.mode === "scale") return [Math.max(0.1, snapTo(amount[0], 0.1)), 0, 0];
    const step = snapStep(this.store.size);
    if (this.axis !== null) {
      const along = this.direction(this.axis);
      return mul(along, snapTo(dot(amount, along), step));
    }
    // The pivot comes to lie on the grid.
    return amount.map((v, i) => snapTo(this.pivot[i] + v, step) - this.pivot[i]) as Vec3;
  }

  type(key: string): boolean {
    if (key === "Backspace") this.typed = this.typed.slice(0, -1);
    else if (/^[\d.,+\-*/() ]$/.test(key)) this.typed += key;
    else return false;
    this.show();
    return true;
  }

  private get values(): number[] | null {
    if (!this.typed) return null;
    const value = parseNumber(this.typed);
    return value === null ? [NaN] : [value];
  }

  private get change(): { offset: Vec3; rotation: Quat; scale: number } {
    const typed = this.values?.[0];
    if (this.mode === "move") {
      if (typed !== undefined) {
        const along = this.direction(this.axis ?? 0);
        return { offset: mul(along, Number.isFinite(typed) ? typed : 0), rotation: NO_ROTATION, scale: 1 };
      }
      let offset = this.amount;
      if (this.axis !== null) offset = mul(this.direction(this.axis), dot(offset, this.direction(this.axis)));
      if (this.plane !== null) offset = sub(offset, mul(this.direction(this.plane), dot(offset, this.direction(this.plane))));
      return { offset, rotation: NO_ROTATION, scale: 1 };
    }
    if (this.mode === "rotate") {
      const angle = typed !== undefined ? ((Number.isFinite(typed) ? typed : 0) * Math.PI) / 180 : this.amount[0];
      const axis = this.axis === null ? this.viewAxis : this.direction(this.axis);
      return { offset: [0, 0, 0], rotation: aboutAxis(axis, angle), scale: 1 };
    }
    const factor = typed !== undefined ? (Number.isFinite(typed) && typed > 0 ? typed : 1) : this.amount[0];
    return { offset: [0, 0, 0], rotation: NO_ROTATION, scale: Math.max(1e-3, factor) };
  }

  private show(): void {
    const chosen = new Map(this.nodes.map((node) => [node.id, this.result(node)]));
    const walk = (node: Node): Node => {
      const changed = chosen.get(node.id);
      if (changed) return changed;
      if (!isGroup(node)) return node;
      const children = node.children.map(walk);
      return children.some((c, i) => c !== node.children[i]) ? { ...node, children } : node;
    };
    // Always from the state before: a drag does not add up its own roundings.
    this.store.preview(walk(this.root) as Group);
  }

  private result(node: Node): Node {
    const change = this.change;
    if (this.mode === "scale" && this.axis !== null && !isGroup(node))
      return { ...node, field: stretched(node.field, this.axis, change.scale) };
    return moved(node, { pivot: this.pivot, ...change });
  }

  get label(): string {
    const count = this.nodes.length;
    return `${VERB[this.mode]} ${count === 1 ? (this.nodes[0] as Part).name || "group" : `${count} parts`}`;
  }

  /** What the status bar says while it goes on. */
  get status(): string {
    const { offset, scale } = this.change;
    const size = this.store.size;
    const unit = this.store.root.unit ?? "";
    const along = this.axis === null ? "" : ` along ${this.local ? "own " : ""}${"XYZ"[this.axis]}`;
    const typed = this.typed ? ` (typed ${this.typed})` : "";
    if (this.mode === "move") {
      if (this.axis !== null) return `Move${along}: ${formatLength(dot(offset, this.direction(this.axis)), size)} ${unit}${typed}`;
      return `Move: ${offset.map((v) => formatLength(v, size)).join(", ")} ${unit}${typed}`;
    }
    if (this.mode === "rotate") {
      const angle = this.values ? this.values[0] : (this.amount[0] * 180) / Math.PI;
      return `Rotate${along.replace("along", "about")}: ${formatNumber(angle, 1)}°${typed}`;
    }
    return `Scale${along}: × ${formatNumber(scale, 3)}${typed}`;
  }

  commit(): void {
    if (this.store.previewing) this.store.commit(this.store.root, this.label);
  }

  cancel(): void {
    this.store.cancel();
  }
}

const snapTo = (value: number, step: number): number => Math.round(value / step) * step;

/** 1, 2 or 5 times a power of ten: about a hundredth of the assembly. */
export const snapStep = (size: number): number => roundDown(size / 80);

/** Of one part its own origin, of several the middle of the box around them. */
export function pivotOf(nodes: Node[]): Vec3 {
  const parts = nodes.flatMap((node) => [...leaves(node)]);
  if (parts.length === 1) return parts[0].translation;
  const box = parts.map(partBox).filter(isFinite3).reduce(joinBoxes, EMPTY);
  if (isFinite3(box)) return middle(box);
  return parts.length ? mul(parts.map((p) => p.translation).reduce(add), 1 / parts.length) : [0, 0, 0];
}
