/** What is selected follows the pointer or what is typed, from the first move until it is confirmed. */

import { toUnit } from "../model/program";
import type { Store } from "../model/store";
import { type Vec3, add, dot, mul, sub } from "../model/vectors";
import { project, rayThrough, type View } from "../view/camera";
import type { Handle } from "./gizmo";
import { type Axis, type Mode, Transform } from "./transform";

type Point = { x: number; y: number }; // pixels of the picture

/** What is seen while something is dragged, and whom to tell. */
export interface Stage {
  readonly view: View;
  readonly size: [number, number];
  onStatus(text: string): void;
  /** Told when it begins and when it ends. */
  onTool(): void;
}

export class Dragging {
  /** By a handle, until the pointer is let go; by the keyboard, until it is confirmed. */
  held = false;
  private transform: Transform | null = null;
  private start: Point = { x: 0, y: 0 };

  constructor(
    private store: Store,
    private stage: Stage,
  ) {}

  get active(): boolean {
    return this.transform !== null;
  }

  byKeys(mode: Mode, from: Point): void {
    this.cancel();
    const transform = new Transform(this.store, mode, null, mode === "scale");
    if (!transform.possible) {
      this.stage.onStatus(this.store.selection.size ? "What is selected is locked." : "Select a part first: click it.");
      return;
    }
    this.transform = transform;
    this.start = { ...from };
    this.stage.onStatus(transform.status);
    this.stage.onTool();
  }

  /** Whether there is anything that the handle can move. */
  byHandle(handle: Handle, from: Point): boolean {
    this.cancel();
    const transform = new Transform(this.store, handle.mode, handle.plane ? null : handle.axis, handle.local);
    if (handle.plane && handle.axis !== null) transform.constrain(handle.axis, true);
    if (!transform.possible) return false;
    this.transform = transform;
    this.held = true;
    this.start = from;
    return true;
  }

  to(at: Point, snap: boolean): void {
    const { transform } = this;
    if (!transform || transform.typed) return;
    if (transform.mode === "move") this.moveTo(transform, at, snap);
    else if (transform.mode === "rotate") this.turnTo(transform, at, snap);
    else this.scaleTo(transform, at, snap);
    this.stage.onStatus(transform.status);
  }

  private middle(transform: Transform) {
    return project(this.stage.view, toUnit(this.store.frame, transform.pivot), ...this.stage.size);
  }

  private moveTo(transform: Transform, at: Point, snap: boolean): void {
    const { view, size } = this.stage;
    const depth = Math.max(this.middle(transform).depth, 0.01);
    const pixel = (2 * view.half[1] * depth) / size[1] / this.store.frame.scale;
    const [dx, dy] = [at.x - this.start.x, at.y - this.start.y];
    let offset = add(mul(view.right, dx * pixel), mul(view.up, -dy * pixel));
    if (transform.axis !== null) {
      // As far along the axis as its picture moves with the pointer.
      const along = transform.direction(transform.axis);
      const [ax, ay] = [dot(along, view.right), -dot(along, view.up)];
      const seen = Math.max(ax * ax + ay * ay, 0.02);
      offset = mul(along, ((dx * ax + dy * ay) / seen) * pixel);
    } else if (transform.plane !== null) {
      const centre = toUnit(this.store.frame, transform.pivot);
      offset = this.onPlane(transform.direction(transform.plane), centre, at) ?? offset;
    }
    transform.by(offset, view.back, snap);
  }

  private turnTo(transform: Transform, at: Point, snap: boolean): void {
    const { view } = this.stage;
    const middle = this.middle(transform);
    const angle = (p: Point) => Math.atan2(-(p.y - middle.y), p.x - middle.x);
    let turn = angle(at) - angle(this.start);
    turn = Math.atan2(Math.sin(turn), Math.cos(turn));
    const axis = transform.axis === null ? view.back : transform.direction(transform.axis);
    const facing = dot(axis, view.back);
    // A ring seen from its edge turns as the pointer goes along it.
    if (Math.abs(facing) < 0.2) {
      const [dx, dy] = [at.x - this.start.x, at.y - this.start.y];
      turn = (dx * dot(axis, view.up) + dy * dot(axis, view.right)) / 90;
    } else if (facing < 0) turn = -turn;
    transform.by([turn, 0, 0], view.back, snap);
  }

  private scaleTo(transform: Transform, at: Point, snap: boolean): void {
    const middle = this.middle(transform);
    const from = Math.max(Math.hypot(this.start.x - middle.x, this.start.y - middle.y), 12);
    const factor = Math.max(0.02, Math.hypot(at.x - middle.x, at.y - middle.y) / from);
    transform.by([factor, 0, 0], this.stage.view.back, snap);
  }

  /** How far the pointer has gone on the plane through `centre` (of the unit frame), in own units. */
  private onPlane(normal: Vec3, centre: Vec3, at: Point): Vec3 | null {
    const { view, size } = this.stage;
    const meet = (p: Point): Vec3 | null => {
      const ray = rayThrough(view, p.x, p.y, ...size);
      const t = dot(sub(centre, view.eye), normal) / dot(ray, normal);
      return t > 0 && t < 60 ? add(view.eye, mul(ray, t)) : null;
    };
    const [a, b] = [meet(this.start), meet(at)];
    return a && b ? mul(sub(b, a), 1 / this.store.frame.scale) : null;
  }

  /** A key while something is moved; whether it was taken. */
  key(event: KeyboardEvent): boolean {
    const { transform } = this;
    if (!transform) return false;
    const axis = "xyz".indexOf(event.key.toLowerCase());
    if (event.key === "Escape") this.cancel();
    else if (event.key === "Enter") this.finish();
    else if (axis >= 0 && event.key.length === 1) transform.constrain(axis as Axis, event.shiftKey && transform.mode === "move");
    else if (!transform.type(event.key)) return ["g", "r", "s"].includes(event.key.toLowerCase());
    if (this.transform) this.stage.onStatus(transform.status);
    return true;
  }

  finish(): void {
    const { transform } = this;
    this.transform = null; // before the edit is told to all who look
    transform?.commit();
    this.end();
  }

  cancel(): void {
    if (!this.transform) return;
    this.transform.cancel();
    this.end();
  }

  private end(): void {
    this.transform = null;
    this.held = false;
    this.stage.onStatus("");
    this.stage.onTool();
  }
}
