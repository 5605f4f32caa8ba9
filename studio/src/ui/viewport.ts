/** What is done in the picture: orbit, pan, zoom, select, drag handles, measure. */

import { Dragging } from "../edit/dragging";
import { drawGizmo, type Handle } from "../edit/gizmo";
import type { Measurement, Measuring } from "../edit/measure";
import { Region } from "../edit/region";
import type { Mode } from "../edit/transform";
import type { Store } from "../model/store";
import { add, dot, mul, sub } from "../model/vectors";
import { rayThrough } from "../view/camera";
import { type Hit, through } from "../view/picking";
import { h, svg } from "./dom";
import { Measurements } from "./measurements";
import { Scene } from "./scene";

export type Tool = "select" | Mode | "measure";

const DRAG = 4; // pixels that a click may wander

export class Viewport extends Scene {
  tool: Tool = "select";
  readonly measured: Measurements;
  readonly dragging: Dragging;
  onStatus: (text: string) => void = () => {};
  onTool: () => void = () => {};
  private overlay = svg("svg", { class: "overlay" });
  private gizmoLayer = svg("g");
  readonly region: Region;
  private pointers = new Map<number, { x: number; y: number }>();
  private gesture: { x: number; y: number; moved: boolean; button: number; pan: boolean } | null = null;
  private last = { x: 0, y: 0 };

  constructor(store: Store) {
    super(store);
    this.dragging = new Dragging(store, this);
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
    this.dragging.cancel();
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
    if (this.dragging.active && !this.dragging.held) {
      if (event.button === 2) this.dragging.cancel();
      else this.dragging.finish();
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
    if (this.dragging.active) {
      this.dragging.to(at, event.ctrlKey !== this.store.snapping);
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
    if (this.dragging.held) {
      if (cancelled) this.dragging.cancel();
      else this.dragging.finish();
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

  private beginDrag(handle: Handle, event: PointerEvent): void {
    event.stopPropagation();
    event.preventDefault();
    this.last = this.place(event);
    if (this.dragging.byHandle(handle, this.last)) this.element.setPointerCapture(event.pointerId);
  }

  /** By the keyboard: follows the pointer until it is confirmed. */
  beginTransform(mode: Mode): void {
    this.dragging.byKeys(mode, this.last);
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
