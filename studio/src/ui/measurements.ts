/** What has been measured, and the points of what is being measured now. */

import { type Measurement, type Measuring, measure, POINTS } from "../edit/measure";
import { isLearned } from "../model/learned";
import { fromUnit, toUnit } from "../model/program";
import type { Store } from "../model/store";
import { type Vec3, add, mul } from "../model/vectors";
import { project, type View } from "../view/camera";
import { across, type Hit, through } from "../view/picking";
import { svg } from "./dom";
import type { Scene } from "./scene";

const SAID = { distance: "Distance", diameter: "Across", thickness: "Through", angle: "Angle" };

export class Measurements {
  kind: Measuring = "distance";
  readonly list: Measurement[] = [];
  readonly layer = svg("g", { class: "measures" });
  private points: Vec3[] = [];

  constructor(
    private store: Store,
    private scene: Scene,
    private say: (text: string) => void,
  ) {}

  /** Forgets the points of what is not complete. */
  begin(): void {
    this.points = [];
  }

  clear(): void {
    this.list.length = 0;
    this.points = [];
  }

  add(hit: Hit): void {
    const { store } = this;
    this.points.push(fromUnit(store.frame, hit.point));
    if (this.points.length < POINTS[this.kind]) return;
    let { points } = this;
    this.points = [];
    if (this.kind === "thickness" || this.kind === "diameter") {
      const other = this.opposite(hit);
      if (!other) return this.say("There is no other side straight through from here.");
      points = [points[0], fromUnit(store.frame, other.point)];
    }
    const made = measure(this.kind, points, store.size, store.root.unit);
    this.list.push(made);
    this.say(`${SAID[made.kind]}: ${made.label}`);
  }

  /** The other side of what is clicked: where its material ends, or, of a diameter, all across the part. */
  private opposite(hit: Hit): Hit | null {
    const { program } = this.store;
    const whole = this.kind === "diameter";
    if (!isLearned(program.parts[hit.part])) return whole ? across(program, hit) : through(program, hit);
    const inwards = mul(hit.normal, -1);
    if (whole) return this.scene.learnedHit(add(hit.point, mul(inwards, 4)), hit.normal, 0, hit.part);
    return this.scene.learnedHit(hit.point, inwards, 1e-3, hit.part);
  }

  draw(view: View, width: number, height: number): void {
    const { layer, store } = this;
    layer.replaceChildren();
    const on = (p: Vec3) => project(view, toUnit(store.frame, p), width, height);
    for (const { points, label, kind } of this.list) {
      const at = points.map(on);
      if (at.some((p) => p.depth <= 0)) continue;
      layer.append(svg("polyline", { points: at.map((p) => `${p.x},${p.y}`).join(" ") }));
      for (const p of at) layer.append(svg("circle", { cx: p.x, cy: p.y, r: 3 }));
      const where = kind === "angle" ? at[1] : { x: (at[0].x + at[1].x) / 2, y: (at[0].y + at[1].y) / 2 };
      const wide = label.length * 7.2 + 14;
      layer.append(
        svg("rect", { x: where.x - wide / 2, y: where.y - 26, width: wide, height: 20, rx: 4 }),
        svg("text", { x: where.x, y: where.y - 12 }, label),
      );
    }
    for (const p of this.points.map(on)) layer.append(svg("circle", { cx: p.x, cy: p.y, r: 4, class: "pending" }));
  }
}
