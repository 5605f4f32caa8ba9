/**
 * A box in space where a part is missing. A rectangle is dragged over the picture; what of the input lies in it, and
 * near no part, says how far the box goes. Its faces can then be moved by handles.
 */

import { programDistance } from "../model/distance";
import { fromUnit, toUnit } from "../model/program";
import type { Store } from "../model/store";
import { type Box, type Vec3, add, corners, dot, EMPTY, grownBox, isEmpty, joinBoxes, longestSide, middle, mul } from "../model/vectors";
import { h, svg } from "../ui/dom";
import { project, type View } from "../view/camera";

interface Place {
  x: number;
  y: number;
}

const NEAR = 0.012; // of the unit frame: what is nearer to a part is not missing
const ROOM = 0.04; // of the longest side, around what is missing
const THINNEST = 0.01;
const EDGES = [0, 1, 2, 3, 4, 5, 6, 7].flatMap((i) => [1, 2, 4].filter((bit) => !(i & bit)).map((bit) => [i, i | bit]));

export class Region {
  readonly bar = h("div", { class: "region-bar float", hidden: true });
  readonly layer = svg("g", { class: "region" });
  /** Places (N, 3) of the input's surface, own units. */
  surface: Float32Array | null = null;
  /** What a part is wanted for, own units. */
  onFit: (box: Box) => void = () => {};
  onStatus: (text: string) => void = () => {};
  onEnd: () => void = () => {};
  redraw: () => void = () => {};
  /** In the unit frame; null before it is drawn. */
  box: Box | null = null;
  private from: Place | null = null;
  private to: Place | null = null;
  private fit = h("button", { type: "button", class: "primary", onclick: () => this.finish() }, "Fit a part in it");

  constructor(private store: Store) {
    const again = h("button", { type: "button", onclick: () => this.begin() }, "Draw again");
    const cancel = h("button", { type: "button", onclick: () => this.end() }, "Cancel");
    this.bar.append(this.fit, again, cancel);
  }

  get active(): boolean {
    return !this.bar.hidden;
  }

  begin(): void {
    this.box = this.from = this.to = null;
    this.bar.hidden = false;
    this.fit.disabled = true;
    this.onStatus("Drag a rectangle over what is missing.");
    this.redraw();
  }

  end(): void {
    this.box = this.from = this.to = null;
    this.bar.hidden = true;
    this.layer.replaceChildren();
    this.onStatus("");
    this.onEnd();
  }

  private finish(): void {
    const { box, store } = this;
    this.end();
    if (box) this.onFit([fromUnit(store.frame, box[0]), fromUnit(store.frame, box[1])]);
  }

  /** Whether a press begins a rectangle here. */
  down(at: Place): boolean {
    if (!this.active || this.box) return false;
    this.from = this.to = at;
    return true;
  }

  /** Whether the pointer draws. */
  move(at: Place): boolean {
    if (!this.from) return false;
    this.to = at;
    this.redraw();
    return true;
  }

  up(view: View, width: number, height: number): boolean {
    const { from, to } = this;
    if (!from || !to) return false;
    this.from = this.to = null;
    const [low, high] = [
      [Math.min(from.x, to.x), Math.min(from.y, to.y)],
      [Math.max(from.x, to.x), Math.max(from.y, to.y)],
    ];
    if (high[0] - low[0] < 5 || high[1] - low[1] < 5) this.onStatus("Drag a rectangle over what is missing: from one corner to the other.");
    else {
      this.box = this.missing((p) => {
        const seen = project(view, p, width, height);
        return seen.depth > 0 && seen.x >= low[0] && seen.x <= high[0] && seen.y >= low[1] && seen.y <= high[1];
      });
      this.onStatus(
        this.box ? "Move the box's faces by their handles, then “Fit a part in it”." : "Nothing is missing there: all of the input in the rectangle is near a part.",
      );
    }
    this.fit.disabled = !this.box;
    this.redraw();
    return true;
  }

  /** A box around the places of the input that the rectangle holds and no part is near to. */
  private missing(within: (p: Vec3) => boolean): Box | null {
    const { store, surface } = this;
    let box = EMPTY;
    for (let i = 0; surface && i < surface.length; i += 3) {
      const p = toUnit(store.frame, [surface[i], surface[i + 1], surface[i + 2]]);
      if (within(p) && programDistance(store.program, ...p) > NEAR) box = joinBoxes(box, [p, p]);
    }
    return isEmpty(box) ? null : grownBox(box, Math.max(ROOM * longestSide(box), THINNEST));
  }

  draw(view: View, width: number, height: number): void {
    const { layer, from, to, box } = this;
    layer.replaceChildren();
    if (from && to) {
      const [x, y] = [Math.min(from.x, to.x), Math.min(from.y, to.y)];
      layer.append(svg("rect", { x, y, width: Math.abs(to.x - from.x), height: Math.abs(to.y - from.y) }));
    }
    if (!box) return;
    const at = corners(box).map((p) => project(view, p, width, height));
    if (at.some((p) => p.depth <= 0)) return;
    for (const [a, b] of EDGES) layer.append(svg("line", { x1: at[a].x, y1: at[a].y, x2: at[b].x, y2: at[b].y }));
    for (const axis of [0, 1, 2])
      for (const side of [0, 1]) {
        const centre = middle(box);
        centre[axis] = box[side][axis];
        const p = project(view, centre, width, height);
        const handle = svg("circle", { cx: p.x, cy: p.y, r: 6, class: `axis-${axis}`, "data-face": `${"xyz"[axis]}${side ? "+" : "-"}` });
        handle.addEventListener("pointerdown", (event) => this.dragFace(event, axis, side, centre, view, width, height));
        layer.append(handle);
      }
  }

  private dragFace(event: PointerEvent, axis: number, side: number, centre: Vec3, view: View, width: number, height: number): void {
    event.stopPropagation();
    event.preventDefault();
    const before = this.box!;
    const along: Vec3 = [0, 0, 0];
    along[axis] = 1;
    const [a, b] = [project(view, centre, width, height), project(view, add(centre, mul(along, 1e-3)), width, height)];
    const step: Vec3 = [(b.x - a.x) * 1e3, (b.y - a.y) * 1e3, 0]; // pixels a unit length
    const seen = Math.max(dot(step, step), 100);
    // The layer is drawn anew while it is dragged, so the window listens.
    const move = (next: PointerEvent) => {
      const by = ((next.clientX - event.clientX) * step[0] + (next.clientY - event.clientY) * step[1]) / seen;
      const box: Box = [[...before[0]], [...before[1]]];
      const other = before[1 - side][axis];
      box[side][axis] = side ? Math.max(before[1][axis] + by, other + THINNEST) : Math.min(before[0][axis] + by, other - THINNEST);
      this.box = box;
      this.redraw();
    };
    const up = () => {
      window.removeEventListener("pointermove", move);
      window.removeEventListener("pointerup", up);
      window.removeEventListener("pointercancel", up);
    };
    window.addEventListener("pointermove", move);
    window.addEventListener("pointerup", up);
    window.addEventListener("pointercancel", up);
  }
}

/** Places of a mesh's surface, evenly by area: the same each time. */
export function surfacePlaces(places: Float32Array, triangles: Uint32Array, count: number): Float32Array {
  const corner = (i: number): Vec3 => [places[3 * i], places[3 * i + 1], places[3 * i + 2]];
  const areas = new Float64Array(triangles.length / 3);
  let whole = 0;
  for (let i = 0; i < areas.length; i++) {
    const [a, b, c] = [0, 1, 2].map((k) => corner(triangles[3 * i + k]));
    const [u, v] = [b.map((x, k) => x - a[k]), c.map((x, k) => x - a[k])];
    const area = Math.hypot(u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]);
    areas[i] = whole += Number.isFinite(area) ? area : 0;
  }
  const result = new Float32Array(count * 3);
  let triangle = 0;
  for (let n = 0; n < count && areas.length; n++) {
    while (triangle < areas.length - 1 && areas[triangle] < ((n + 0.5) / count) * whole) triangle++;
    // A plane sequence of low discrepancy, folded into the triangle.
    let [u, v] = [(n * 0.7548776662) % 1, (n * 0.5698402910) % 1];
    if (u + v > 1) [u, v] = [1 - u, 1 - v];
    const [a, b, c] = [0, 1, 2].map((k) => corner(triangles[3 * triangle + k]));
    for (let k = 0; k < 3; k++) result[3 * n + k] = a[k] + u * (b[k] - a[k]) + v * (c[k] - a[k]);
  }
  return result;
}
