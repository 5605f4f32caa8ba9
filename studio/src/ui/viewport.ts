/** What is done in the picture: orbit, pan, zoom, select, drag handles, measure. */

import { drawGizmo, type Handle } from "../edit/gizmo";
import type { Measurement, Measuring } from "../edit/measure";
import { Region } from "../edit/region";
import { type Axis, type Mode, Transform } from "../edit/transform";
import { toUnit } from "../model/program";
import type { Store } from "../model/store";
import { type Vec3, add, dot, mul, sub } from "../model/vectors";
import { project, rayThrough } from "../view/camera";
import { type Hit, through } from "../view/picking";
import { h, svg } from "./dom";
import { Measurements } from "./measurements";
import { Scene } from "./scene";

export type Tool = "select" | Mode | "measure";

const DRAG = 4; // pixels that a click may wander

export class Viewport extends Scene {
  tool: Tool = "select";
  readonly measured: Measurements;
  transform: Transform | null = null;
  onStatus: (text: string) => void = () => {};
  onTool: () => void = () => {};
  private overlay = svg("svg", { class: "overlay" });
  private gizmoLayer = svg("g");
  readonly region: Region;
  private pointers = new Map<number, { x: number; y: number }>();
  private gesture: { x: number; y: number; moved: boolean; button: number; pan: boolean } | null = null;
  private last = { x: 0, y: 0 };
  private start = { x: 0, y: 0 };
  private dragging = false;

  constructor(store: Store) {
    super(store);
    this.region = new Region(store);
    this.region.redraw = () => this.drawOverlay();
    this.region.onStatus = (text) => this.onStatus(text);
    this.measured = new Measurements(store, this, (text) => this.onStatus(text));
    this.overlay.append(this.measured.layer, this.region.layer, this.gizmoLayer);
    this.element.append(this.overlay, this.region.bar);
    this.listen();
  }

  get measuring(): Measuring {
    return this.measured.kind;
  }

  set measuring(kind: Measuring) {
    this.measured.kind = kind;
  }

  get measurements(): Measurement[] {
    return this.measured.list;
  }

  protected override resize(): void {
    this.overlay?.setAttribute("viewBox", `0 0 ${this.element.clientWidth} ${this.element.clientHeight}`);
    super.resize();
  }

  setTool(tool: Tool): void {
    this.cancelTransform();
    this.tool = tool;
    this.measured.begin();
    this.onTool();
    this.drawOverlay();
  }

  // What the pointer does

  private listen(): void {
    const { element } = this;
    element.addEventListener("pointerdown", (event) => this.down(event));
    element.addEventListener("pointermove", (event) => this.move(event));
    element.addEventListener("pointerup", (event) => this.up(event));
    element.addEventListener("pointercancel", (event) => this.up(event, true));
    element.addEventListener("pointerleave", () => this.store.hover(null));
    element.addEventListener("contextmenu", (event) => event.preventDefault());
    element.addEventListener(
      "wheel",
      (event) => {
        event.preventDefault();
        const { x, y } = this.place(event);
        this.zoomAt(x, y, Math.exp(event.deltaY * (event.ctrlKey ? 0.01 : 0.0012)));
      },
      { passive: false },
    );
  }

  private place(event: { clientX: number; clientY: number }): { x: number; y: number } {
    const box = this.element.getBoundingClientRect();
    return { x: event.clientX - box.left, y: event.clientY - box.top };
  }

  /** Of the parts' picture, which is the right half where the input stands beside it. */
  private inView(at: { x: number; y: number }): { x: number; y: number } {
    const shift = this.renderer?.look.show === "beside" ? this.size[0] : 0;
    return { x: at.x - shift, y: at.y };
  }

  /** What is under the pointer stays there. */
  private zoomAt(x: number, y: number, factor: number): void {
    const [width, height] = this.size;
    const across = this.renderer?.look.show === "beside" ? x % width : x;
    const ray = rayThrough(this.view, across, y, width, height);
    const before = this.camera.distance;
    this.camera.zoom(factor);
    const share = 1 - this.camera.distance / before;
    const along = before / Math.max(-dot(ray, this.view.back), 0.1);
    const under = add(add(this.camera.target, mul(this.view.back, before)), mul(ray, along));
    this.camera.target = add(this.camera.target, mul(sub(under, this.camera.target), share));
    this.look();
  }

  private down(event: PointerEvent): void {
    if ((event.target as Element).closest("button, .float")) return;
    this.canvas.focus({ preventScroll: true });
    const at = this.place(event);
    this.last = at;
    if (this.transform && !this.dragging) {
      if (event.button === 2) this.cancelTransform();
      else this.finishTransform();
      return;
    }
    if (event.button === 0 && this.region.down(this.inView(at))) {
      this.element.setPointerCapture(event.pointerId);
      return;
    }
    this.pointers.set(event.pointerId, at);
    this.element.setPointerCapture(event.pointerId);
    const pan = event.button === 1 || event.button === 2 || event.shiftKey;
    if (this.pointers.size === 1) this.gesture = { ...at, moved: false, button: event.button, pan };
  }

  private move(event: PointerEvent): void {
    const at = this.place(event);
    const previous = this.pointers.get(event.pointerId);
    const [dx, dy] = [at.x - (previous ?? this.last).x, at.y - (previous ?? this.last).y];
    this.last = at;
    if (this.region.move(this.inView(at))) return;
    if (this.transform) {
      this.drag(at, event.ctrlKey !== this.store.snapping);
      return;
    }
    if (!previous) {
      if (event.pointerType === "mouse" && event.buttons === 0) this.hoverAt(at);
      return;
    }
    if (this.pointers.size === 2) {
      const [a, b] = [...this.pointers.values()];
      const before = Math.hypot(a.x - b.x, a.y - b.y);
      this.pointers.set(event.pointerId, at);
      const [c, d] = [...this.pointers.values()];
      const now = Math.hypot(c.x - d.x, c.y - d.y);
      if (now > 1) this.camera.zoom(before / now);
      this.camera.pan((c.x + d.x - a.x - b.x) / 2, (c.y + d.y - a.y - b.y) / 2, this.size[1]);
      if (this.gesture) this.gesture.moved = true;
      this.look();
      return;
    }
    this.pointers.set(event.pointerId, at);
    const { gesture } = this;
    if (!gesture) return;
    if (!gesture.moved && Math.hypot(at.x - gesture.x, at.y - gesture.y) < DRAG) return;
    gesture.moved = true;
    if (gesture.pan) this.camera.pan(dx, dy, this.size[1]);
    else this.camera.orbit(dx * 0.45, dy * 0.45);
    this.look();
  }

  private up(event: PointerEvent, cancelled = false): void {
    if (this.region.up(this.view, ...this.size)) return;
    this.pointers.delete(event.pointerId);
    if (this.dragging) {
      this.dragging = false;
      if (cancelled) this.cancelTransform();
      else this.finishTransform();
      return;
    }
    const { gesture } = this;
    if (this.pointers.size) return;
    this.gesture = null;
    if (!gesture || gesture.moved || cancelled || gesture.button !== 0) return;
    this.click(this.place(event), event.shiftKey || event.metaKey);
  }

  private hoverAt(at: { x: number; y: number }): void {
    const hit = this.hitAt(at);
    this.store.hover(hit ? (this.store.program.parts[hit.part]?.id ?? null) : null);
  }

  private awaited: ((hit: Hit, depth: number | null) => void) | null = null;

  /** What the next click on the surface is for; depth: of the material there, own units, null where it is not told. */
  clickOnce(status: string, then: (hit: Hit, depth: number | null) => void): void {
    this.setTool("select");
    this.awaited = then;
    this.onStatus(status);
  }

  forgetClick(): boolean {
    const was = this.awaited !== null;
    this.awaited = null;
    if (was) this.onStatus("");
    return was;
  }

  private click(at: { x: number; y: number }, more: boolean): void {
    const hit = this.hitAt(at);
    const { awaited } = this;
    if (awaited && hit) {
      this.forgetClick();
      const other = through(this.store.program, hit);
      return awaited(hit, other && other.distance / this.store.frame.scale);
    }
    if (this.tool === "measure") {
      if (hit) this.measured.add(hit);
      this.drawOverlay();
      return;
    }
    const part = hit && this.store.program.parts[hit.part];
    if (part) this.store.select([part.id], more);
    else if (!more) this.store.select([]);
  }

  private wipe: HTMLElement | null = null;

  /** A line across the picture that is dragged: the input on its left, the parts on its right. */
  wipeHandle(on: boolean): void {
    this.wipe?.remove();
    this.wipe = null;
    if (!on || !this.renderer) return;
    const handle = h("div", { class: "wipe float", role: "slider", "aria-label": "Wipe between input and parts", tabindex: "0" });
    const place = (share: number) => {
      const at = Math.max(0.02, Math.min(0.98, share));
      handle.style.left = `${at * 100}%`;
      handle.setAttribute("aria-valuenow", String(Math.round(at * 100)));
      this.renderer!.setLook({ wipe: at });
    };
    handle.addEventListener("pointerdown", (event) => handle.setPointerCapture(event.pointerId));
    handle.addEventListener("pointermove", (event) => {
      if (event.buttons) place(this.place(event).x / this.element.clientWidth);
    });
    handle.addEventListener("keydown", (event) => {
      const by = { ArrowLeft: -0.05, ArrowRight: 0.05 }[event.key];
      if (by) place(this.renderer!.look.wipe + by);
    });
    place(this.renderer.look.wipe);
    this.wipe = handle;
    this.element.append(handle);
  }

  clearMeasurements(): void {
    this.measured.clear();
    this.drawOverlay();
  }

  // Moving, turning, scaling

  /** By the keyboard: follows the pointer until it is confirmed. */
  beginTransform(mode: Mode, axis: Axis | null = null): void {
    this.cancelTransform();
    const transform = new Transform(this.store, mode, axis, mode === "scale");
    if (!transform.possible) {
      this.onStatus(this.store.selection.size ? "What is selected is locked." : "Select a part first: click it.");
      return;
    }
    this.transform = transform;
    this.start = { ...this.last };
    this.onStatus(transform.status);
    this.onTool();
  }

  private beginDrag(handle: Handle, event: PointerEvent): void {
    event.stopPropagation();
    event.preventDefault();
    this.cancelTransform();
    const transform = new Transform(this.store, handle.mode, handle.plane ? null : handle.axis, handle.local);
    if (handle.plane && handle.axis !== null) transform.constrain(handle.axis, true);
    if (!transform.possible) return;
    this.transform = transform;
    this.dragging = true;
    this.start = this.last = this.place(event);
    this.element.setPointerCapture(event.pointerId);
  }

  private drag(at: { x: number; y: number }, snap: boolean): void {
    const transform = this.transform!;
    if (transform.typed) return;
    const { view } = this;
    const [width, height] = this.size;
    const centre = toUnit(this.store.frame, transform.pivot);
    const middle = project(view, centre, width, height);
    const pixel = (2 * view.half[1] * Math.max(middle.depth, 0.01)) / height / this.store.frame.scale;
    const [dx, dy] = [at.x - this.start.x, at.y - this.start.y];
    if (transform.mode === "move") {
      let offset = add(mul(view.right, dx * pixel), mul(view.up, -dy * pixel));
      if (transform.axis !== null) {
        // As far along the axis as its picture moves with the pointer.
        const along = transform.direction(transform.axis);
        const [ax, ay] = [dot(along, view.right), -dot(along, view.up)];
        const seen = Math.max(ax * ax + ay * ay, 0.02);
        offset = mul(along, ((dx * ax + dy * ay) / seen) * pixel);
      } else if (transform.plane !== null) {
        offset = this.onPlane(transform.direction(transform.plane), centre, at) ?? offset;
      }
      transform.by(offset, view.back, snap);
    } else if (transform.mode === "rotate") {
      const angle = (p: { x: number; y: number }) => Math.atan2(-(p.y - middle.y), p.x - middle.x);
      let turn = angle(at) - angle(this.start);
      turn = Math.atan2(Math.sin(turn), Math.cos(turn));
      const axis = transform.axis === null ? view.back : transform.direction(transform.axis);
      const facing = dot(axis, view.back);
      // A ring seen from its edge turns as the pointer goes along it.
      if (Math.abs(facing) < 0.2) {
        const along = [dot(axis, view.up), dot(axis, view.right)];
        turn = (dx * along[0] + dy * along[1]) / 90;
      } else if (facing < 0) turn = -turn;
      transform.by([turn, 0, 0], view.back, snap);
    } else {
      const from = Math.max(Math.hypot(this.start.x - middle.x, this.start.y - middle.y), 12);
      transform.by([Math.max(0.02, Math.hypot(at.x - middle.x, at.y - middle.y) / from), 0, 0], view.back, snap);
    }
    this.onStatus(transform.status);
  }

  /** How far the pointer has gone on the plane through `centre` (of the unit frame), in own units. */
  private onPlane(normal: Vec3, centre: Vec3, at: { x: number; y: number }): Vec3 | null {
    const [width, height] = this.size;
    const { view } = this;
    const meet = (p: { x: number; y: number }): Vec3 | null => {
      const ray = rayThrough(view, p.x, p.y, width, height);
      const t = dot(sub(centre, view.eye), normal) / dot(ray, normal);
      return t > 0 && t < 60 ? add(view.eye, mul(ray, t)) : null;
    };
    const [a, b] = [meet(this.start), meet(at)];
    return a && b ? mul(sub(b, a), 1 / this.store.frame.scale) : null;
  }

  /** A key while something is moved; whether it was taken. */
  transformKey(event: KeyboardEvent): boolean {
    const { transform } = this;
    if (!transform) return false;
    const axis = "xyz".indexOf(event.key.toLowerCase());
    if (event.key === "Escape") this.cancelTransform();
    else if (event.key === "Enter") this.finishTransform();
    else if (axis >= 0 && event.key.length === 1) transform.constrain(axis as Axis, event.shiftKey && transform.mode === "move");
    else if (!transform.type(event.key)) return ["g", "r", "s"].includes(event.key.toLowerCase());
    if (this.transform) this.onStatus(transform.status);
    return true;
  }

  private finishTransform(): void {
    const { transform } = this;
    this.transform = null;
    this.dragging = false;
    transform?.commit();
    this.onStatus("");
    this.onTool();
  }

  cancelTransform(): void {
    if (!this.transform) return;
    this.transform.cancel();
    this.transform = null;
    this.dragging = false;
    this.onStatus("");
    this.onTool();
  }

  // Over the picture

  override drawOverlay(): void {
    if (!this.renderer) return;
    const [width, height] = this.size;
    const { view, store } = this;
    const shift = this.renderer.look.show === "beside" ? width : 0;
    for (const layer of [this.gizmoLayer, this.measured.layer, this.region.layer]) layer.setAttribute("transform", `translate(${shift} 0)`);
    if (this.tool === "move" || this.tool === "rotate" || this.tool === "scale")
      drawGizmo(this.gizmoLayer, store, this.tool, view, width, height, (handle, event) => this.beginDrag(handle, event));
    else this.gizmoLayer.replaceChildren();
    this.region.draw(view, width, height);
    this.measured.draw(view, width, height);
  }
}
