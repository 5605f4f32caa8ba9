/** Handles over the picture: arrows to move, rings to turn, boxes to scale. Drawn as vectors, crisp at any size. */

import type { Store } from "../model/store";
import { isGroup, type Part } from "../model/tree";
import { toUnit } from "../model/program";
import { type Quat, type Vec3, add, cross, matrix, mul, NO_ROTATION, unit, dot } from "../model/vectors";
import { svg } from "../ui/dom";
import { type View, project } from "../view/camera";
import { type Axis, type Mode, pivotOf } from "./transform";

export interface Handle {
  mode: Mode;
  axis: Axis | null;
  plane: boolean;
  local: boolean;
}

const LENGTH = 78; // pixels
const AXES: Axis[] = [0, 1, 2];

/** The frame of the handles: moves and turns are along the world's axes, scales along the part's own. */
export function gizmoFrame(store: Store, mode: Mode): Quat {
  const nodes = store.editable;
  const only = nodes.length === 1 && !isGroup(nodes[0]) ? (nodes[0] as Part) : null;
  return mode === "scale" && only ? only.rotation : NO_ROTATION;
}

export function drawGizmo(
  layer: SVGGElement,
  store: Store,
  mode: Mode,
  view: View,
  width: number,
  height: number,
  begin: (handle: Handle, event: PointerEvent) => void,
): void {
  layer.replaceChildren();
  const nodes = store.editable;
  if (!nodes.length) return;
  const centre = toUnit(store.frame, pivotOf(nodes));
  const at = project(view, centre, width, height);
  if (at.depth <= 0) return;
  const size = (LENGTH * 2 * view.half[1] * at.depth) / height; // of LENGTH pixels, in the unit frame
  const m = matrix(gizmoFrame(store, mode));
  const axes = AXES.map((i) => [m[0][i], m[1][i], m[2][i]] as Vec3);
  const single = nodes.length === 1 && !isGroup(nodes[0]);
  const handle = (shape: SVGElement, what: Handle, title: string) => {
    const group = svg("g", { class: `handle axis-${what.axis ?? "all"}`, "data-handle": `${what.mode}-${what.axis === null ? "all" : "xyz"[what.axis]}${what.plane ? "-plane" : ""}` }, svg("title", {}, title), shape);
    group.addEventListener("pointerdown", (event) => begin(what, event));
    layer.append(group);
  };
  const on = (p: Vec3) => project(view, p, width, height);
  const fat = (d: string) => [svg("path", { d, class: "grip" }), svg("path", { d, class: "line" })];

  if (mode === "rotate") {
    for (const axis of AXES) {
      const points: string[] = [];
      const u = unit(cross(axes[axis], Math.abs(axes[axis][2]) < 0.9 ? [0, 0, 1] : [1, 0, 0]));
      const v = cross(axes[axis], u);
      let front = "";
      for (let i = 0; i <= 64; i++) {
        const a = (i / 64) * 2 * Math.PI;
        const offset = add(mul(u, Math.cos(a)), mul(v, Math.sin(a)));
        const p = on(add(centre, mul(offset, size)));
        const near = dot(offset, view.back) > -0.08;
        front += near ? `${front.endsWith(" ") || !front ? "M" : "L"}${p.x.toFixed(1)} ${p.y.toFixed(1)}` : front.endsWith(" ") || !front ? "" : " ";
        points.push(`${p.x.toFixed(1)} ${p.y.toFixed(1)}`);
      }
      const faint = svg("path", { d: `M${points.join("L")}Z`, class: "line faint" });
      handle(svg("g", {}, faint, ...fat(front)), { mode, axis, plane: false, local: false }, `Turn about ${"XYZ"[axis]}`);
    }
    return;
  }
  // Those that point at the viewer are drawn last.
  const order = [...AXES].sort((a, b) => dot(axes[a], view.back) - dot(axes[b], view.back));
  if (mode === "move") {
    for (const axis of order) {
      const [a, b] = AXES.filter((i) => i !== axis).map((i) => axes[i]);
      if (Math.abs(dot(axes[axis], view.back)) < 0.15) continue; // seen from its edge
      const corner = [0.28, 0.46].map((s) => mul(a, s * size));
      const side = [0.28, 0.46].map((s) => mul(b, s * size));
      const points = [add(corner[0], side[0]), add(corner[1], side[0]), add(corner[1], side[1]), add(corner[0], side[1])];
      const text = points.map((p) => on(add(centre, p))).map((p) => `${p.x.toFixed(1)},${p.y.toFixed(1)}`);
      const names = AXES.filter((i) => i !== axis).map((i) => "XYZ"[i]);
      handle(svg("polygon", { points: text.join(" "), class: "patch" }), { mode, axis, plane: true, local: false }, `Move in ${names.join("")}`);
    }
  }
  for (const axis of order) {
    if (mode === "scale" && !single) break;
    const tip = on(add(centre, mul(axes[axis], size)));
    const root = on(add(centre, mul(axes[axis], size * 0.12)));
    const seen = Math.hypot(tip.x - at.x, tip.y - at.y);
    if (seen < 10) continue; // it points at the viewer
    const [dx, dy] = [(tip.x - at.x) / seen, (tip.y - at.y) / seen];
    const stem = fat(`M${root.x} ${root.y}L${tip.x} ${tip.y}`);
    const head =
      mode === "move"
        ? svg("path", { class: "head", d: `M${tip.x + dx * 12} ${tip.y + dy * 12}L${tip.x - dy * 5} ${tip.y + dx * 5}L${tip.x + dy * 5} ${tip.y - dx * 5}Z` })
        : svg("rect", { class: "head", x: tip.x - 5, y: tip.y - 5, width: 10, height: 10, rx: 1.5 });
    const label = svg("text", { x: tip.x + dx * 21, y: tip.y + dy * 21 }, "XYZ"[axis]);
    const title = mode === "move" ? `Move along ${"XYZ"[axis]}` : `Stretch along the part's own ${"XYZ"[axis]}`;
    handle(svg("g", {}, ...stem, head, label), { mode, axis, plane: false, local: mode === "scale" }, title);
  }
  const dot_ = svg("circle", { cx: at.x, cy: at.y, r: mode === "scale" ? 9 : 6, class: "middle" });
  handle(dot_, { mode, axis: null, plane: false, local: false }, mode === "scale" ? "Scale evenly" : "Move freely");
}

