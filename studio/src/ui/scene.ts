/** What is in the picture: the parts, their images and meshes, the input, the camera, and what a ray meets. */

import { combined, isLearned, type Meshes, rayHit, smoothNormals, type Triangles } from "../model/learned";
import { roundDown } from "../model/lengths";
import { type Maps, PartMaps } from "../model/maps";
import { rgb } from "../model/palette";
import { fromUnit, partBox, tightBox, toUnit } from "../model/program";
import type { Store } from "../model/store";
import { type Box, type Vec3, add, dot, EMPTY, isFinite3, joinBoxes, mul } from "../model/vectors";
import { Camera, rayThrough, type View } from "../view/camera";
import { NoWebGL } from "../view/gpu";
import { type Hit, pick } from "../view/picking";
import { Renderer } from "../view/renderer";
import { h } from "./dom";

export class Scene {
  readonly element: HTMLElement;
  readonly canvas = h("canvas", { class: "picture", tabindex: "0", "aria-label": "The assembly" });
  readonly camera: Camera;
  renderer: Renderer | null = null;
  readonly maps = new PartMaps(() => this.upload());
  private meshes: Meshes = new Map();
  private uploadedMaps: Maps | null = null;

  constructor(protected store: Store) {
    this.camera = new Camera(store.root.up);
    this.element = h("div", { class: "viewport" }, this.canvas);
    try {
      this.renderer = new Renderer(this.canvas, {
        show: "parts",
        wipe: 0.5,
        heat: false,
        most: 0.03,
        paper: [1, 1, 1],
        ink: [0, 0, 0],
        accent: [0.2, 0.4, 1],
        ground: [0, 0, 1, -0.9],
        grid: 0.1,
      });
      this.renderer.onPicture = () => this.drawOverlay();
      this.renderer.onLost = () => this.restore();
    } catch (error) {
      if (!(error instanceof NoWebGL)) throw error;
      const text = `${error.message} The list of parts, their numbers and the downloads work all the same; to see the shape, use a browser with WebGL 2, or turn on hardware acceleration in this one.`;
      this.element.append(h("div", { class: "no-webgl", role: "alert" }, text));
    }
    store.on(["document", "view"], () => this.upload());
    store.on(["selection", "hover"], () => this.mark());
    new ResizeObserver(() => this.resize()).observe(this.element);
  }

  /** Over the picture, drawn anew with it. */
  drawOverlay(): void {}

  begin(): void {
    this.camera.stand(this.store.root.up);
    this.resize();
    this.frameAll();
    this.upload();
    this.ground();
    if (this.renderer && !this.renderer.ready) void this.standIn();
  }

  /** Told to give the driver all again that it has lost. */
  onLost: () => void = () => {};

  private restore(): void {
    this.uploadedMaps = null;
    this.onLost();
    this.look();
    this.upload();
  }

  /** A coarse mesh, until the shader is compiled. */
  private async standIn(): Promise<void> {
    const { store, renderer } = this;
    if (!store.program.parts.length) return;
    const { mesh } = await import("../mesh/mesher");
    const surface = await mesh(store, 48, this).catch(() => null);
    if (!surface || !renderer || renderer.ready) return;
    const { places, normals, triangles } = surface;
    const colours = new Uint8Array((places.length / 3) * 4);
    for (let i = 0; i < places.length / 3; i++) colours.set([...surface.colours.subarray(3 * i, 3 * i + 3), surface.owners[i] + 1], 4 * i);
    renderer.setMesh("standIn", { places, normals, colours, triangles });
  }

  get size(): [number, number] {
    const half = this.renderer?.look.show === "beside" ? 0.5 : 1;
    return [this.element.clientWidth * half, this.element.clientHeight];
  }

  get view(): View {
    const [width, height] = this.size;
    return this.camera.view(width / Math.max(height, 1));
  }

  protected resize(): void {
    this.renderer?.resize();
    this.look();
  }

  look(): void {
    this.renderer?.setView(this.view);
    this.drawOverlay();
  }

  /** Meshes of learned parts, as they were decoded last. */
  setLearned(meshes: Meshes): void {
    this.meshes = meshes;
    this.upload();
  }

  /** Where the learned parts are now; null where there are none. */
  learned: Triangles | null = null;

  private placeLearned(): void {
    const { store, renderer, meshes } = this;
    const before = this.learned;
    this.learned = meshes.size && store.program.parts.some(isLearned) ? combined(store.program.parts, store.hidden, meshes) : null;
    if (!renderer || (!this.learned && !before)) return;
    if (!this.learned) return renderer.setMesh("learned", null);
    const { places, owners, triangles } = this.learned;
    const { scale, offset } = store.frame;
    const shown = store.program.parts.map((part) => rgb(store.colourOf(part)).map((v) => Math.round(v * 255)));
    const colours = new Uint8Array(owners.length * 4);
    owners.forEach((owner, i) => colours.set([...shown[owner], Math.min(owner + 1, 255)], 4 * i));
    renderer.setMesh("learned", { places: places.map((v, i) => v * scale + offset[i % 3]), normals: smoothNormals(this.learned), colours, triangles });
  }

  /** Whether parts that have baked colours, and normals, show them. */
  baked = true;
  showBaked(on: boolean): void {
    this.baked = on;
    this.upload();
  }

  /** The layers of the parts' images, where they are to be seen. */
  get layers(): number[] {
    return this.baked ? this.maps.of(this.store.program.parts) : [];
  }

  upload(): void {
    const { renderer, store } = this;
    this.placeLearned();
    if (renderer) {
      const layers = this.layers;
      const reliefs = this.baked ? this.maps.of(this.store.program.parts, "normals") : [];
      if (this.maps.maps !== this.uploadedMaps) renderer.setMaps((this.uploadedMaps = this.maps.maps));
      renderer.setColours(store.program.parts.map((part) => rgb(store.colourOf(part))));
      renderer.setProgram(store.program, layers, reliefs);
    }
    this.mark();
    this.drawOverlay();
  }

  mark(): void {
    const chosen = new Set(this.store.selectedParts.map((part) => part.id));
    const marks = this.store.program.parts.map(
      (part) => (chosen.has(part.id) ? 1 : 0) + (part.id === this.store.hovered ? 2 : 0),
    );
    this.renderer?.setMarks(Uint8Array.from(marks));
    this.drawOverlay();
  }

  private ground(): void {
    const { above } = this.camera;
    const box = tightBox(this.store.program);
    const low = Math.min(...[box[0], box[1]].map((corner) => dot(corner, above)));
    this.renderer?.setLook({ ground: [...above, low - 0.002], grid: roundDown(this.store.size / 8) * this.store.frame.scale });
  }

  frameAll(): void {
    const chosen = this.store.selectedParts.map(partBox).filter(isFinite3);
    let box: Box = tightBox(this.store.program);
    if (chosen.length) {
      const own = chosen.reduce(joinBoxes, EMPTY);
      box = [toUnit(this.store.frame, own[0]), toUnit(this.store.frame, own[1])];
    }
    const [width, height] = this.size;
    this.camera.frame(box, width / Math.max(height, 1));
    this.look();
  }

  lookFrom(azimuth: number, elevation: number): void {
    [this.camera.azimuth, this.camera.elevation] = [azimuth, elevation];
    this.look();
  }

  // What a ray meets

  hitAt(at: { x: number; y: number }): Hit | null {
    const [width, height] = this.size;
    let x = at.x;
    if (this.renderer?.look.show === "beside") {
      if (x < width) return null;
      x -= width;
    }
    const { view } = this;
    const ray = rayThrough(view, x, at.y, width, height);
    const hit = pick(this.store.program, view.eye, ray);
    const learned = this.learnedHit(view.eye, ray);
    return learned && (!hit || learned.distance < hit.distance) ? learned : hit;
  }

  /** What a ray of the unit frame meets of the learned parts; only: of one of them. */
  learnedHit(eye: Vec3, ray: Vec3, from = 0, only = -1): Hit | null {
    if (!this.learned) return null;
    const { frame } = this.store;
    const hit = rayHit(this.learned, fromUnit(frame, eye), ray, from / frame.scale, only);
    return hit && { part: hit.part, normal: hit.normal, distance: hit.distance * frame.scale, point: add(eye, mul(ray, hit.distance * frame.scale)) };
  }

  /** What the picture's middle shows. */
  middleHit(): Hit | null {
    const [width, height] = this.size;
    const shift = this.renderer?.look.show === "beside" ? width : 0;
    return this.hitAt({ x: shift + width / 2, y: height / 2 });
  }
}
