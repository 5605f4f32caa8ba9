/**
 * When what is marched and drawn: coarsely while something moves, finely once it rests. Numbers are uploaded,
 * shaders are compiled once.
 */

import type { Maps } from "../model/maps";
import type { Program } from "../model/program";
import type { Vec3 } from "../model/vectors";
import type { View } from "./camera";
import { Gpu, NoWebGL, type Target } from "./gpu";
import { Marcher } from "./marcher";
import type { Mesh } from "./meshes";
import { JITTERS, type Look, Picture } from "./picture";

export type { Look } from "./picture";

const MOVING_MS = 40; // what a frame may take while something moves
const BAND_MS = 60; // what is marched before the page gets its turn
const MOST_PIXELS = 2_000_000; // of pictures that are smoothed

interface Job {
  target: Target;
  jitter: [number, number];
  row: number;
  quick: boolean;
  started: number;
}

export class Renderer {
  /** Of the last whole picture: milliseconds, pixels, passes. */
  lastFrame = { milliseconds: 0, pixels: 0, quick: true };
  pictures = 0;
  /** Told once after each picture. */
  onPicture: () => void = () => {};
  onReady: () => void = () => {};
  /** Told where the driver has lost all that it was given, and is to be given it again. */
  onLost: () => void = () => {};
  ready = false;
  readonly gl: WebGL2RenderingContext;
  private gpu: Gpu;
  private marcher: Marcher;
  private picture: Picture;
  private quick: Target | null = null;
  private full: Target[] = [];
  private complete = 0; // of `full`
  private dirty = true; // what the rays find has changed
  private stale = true; // the picture has to be made anew
  private job: Job | null = null;
  private waiting = false;
  private speed = 2e-4; // milliseconds a pixel
  private lastChange = 0;
  private scheduled = false;
  private starts = 0;

  constructor(
    readonly canvas: HTMLCanvasElement,
    look: Look,
  ) {
    const gl = canvas.getContext("webgl2", { antialias: false, alpha: false, powerPreference: "high-performance" });
    if (!gl) throw new NoWebGL("This browser offers no WebGL 2.");
    this.gl = gl;
    this.gpu = new Gpu(gl);
    this.marcher = new Marcher(this.gpu);
    this.picture = new Picture(this.gpu, this.marcher, look);
    canvas.addEventListener("webglcontextlost", (event) => {
      event.preventDefault();
      this.ready = false;
    });
    canvas.addEventListener("webglcontextrestored", () => {
      this.start();
      this.onLost();
    });
    this.start();
  }

  get look(): Look {
    return this.picture.look;
  }

  get compilations(): number {
    return this.gpu.compilations;
  }

  get uploads(): number {
    return this.marcher.uploads;
  }

  private start(): void {
    const { gl, gpu } = this;
    const start = ++this.starts;
    this.ready = false;
    gpu.forget();
    this.picture.forget();
    this.quick = this.job = null;
    this.full = [];
    this.complete = 0;
    this.waiting = false;
    gl.disable(gl.DITHER);
    this.marcher.forget();
    const parallel = gl.getExtension("KHR_parallel_shader_compile");
    const marching = this.marcher.build();
    this.picture.build();
    const poll = () => {
      if (start !== this.starts || gl.isContextLost()) return;
      const done = ([, program]: [string, WebGLProgram]) => !parallel || gl.getProgramParameter(program, parallel.COMPLETION_STATUS_KHR);
      if (!marching.every(done)) {
        setTimeout(poll, 16);
        return;
      }
      for (const [name, program] of marching) gpu.linked(name, program);
      this.ready = true;
      this.dirty = this.stale = true;
      this.onReady();
      this.ask();
    };
    setTimeout(poll, 0);
  }

  // What is to be seen

  /** layers, reliefs: of each part, the number of its image of colours, and of normals; -1 where it has none. */
  setProgram(program: Program, layers?: number[], reliefs?: number[]): void {
    this.marcher.setProgram(program, layers, reliefs);
    if (this.look.heat) this.picture.meshes.input.dirty = true;
    this.changed();
  }

  /** rgb from 0 to 1 of each part. */
  setColours(colours: Vec3[]): void {
    this.marcher.setColours(colours);
    this.changed();
  }

  setMaps(maps: Maps | null): void {
    this.marcher.setMaps(maps);
    this.changed();
  }

  /** Of each part: 1 selected, 2 hovered, 4 faded. */
  setMarks(marks: Uint8Array): void {
    this.picture.setMarks(marks);
    this.redraw();
  }

  setView(view: View): void {
    this.marcher.setView(view);
    this.picture.changed();
    this.changed();
  }

  setMesh(which: "input" | "standIn" | "learned", mesh: Mesh | null): void {
    this.picture.meshes[which].set(mesh);
    this.redraw();
  }

  get hasInput(): boolean {
    return this.picture.meshes.input.there;
  }

  setLook(changes: Partial<Look>): void {
    this.picture.look = { ...this.look, ...changes };
    this.picture.changed();
    this.redraw();
  }

  resize(): void {
    const ratio = Math.min(window.devicePixelRatio || 1, 2);
    const width = Math.max(1, Math.round(this.canvas.clientWidth * ratio));
    const height = Math.max(1, Math.round(this.canvas.clientHeight * ratio));
    if (this.canvas.width === width && this.canvas.height === height) return;
    this.canvas.width = width;
    this.canvas.height = height;
    this.marcher.tilesDirty = true;
    this.changed();
    // A canvas of another size is black until something is drawn into it.
    if (this.marcher.view && this.marcher.program && !this.gl.isContextLost()) this.draw();
  }

  get aspect(): number {
    return this.canvas.width / this.canvas.height / (this.look.show === "beside" ? 2 : 1);
  }

  // When it is drawn

  private changed(): void {
    this.dirty = this.stale = true;
    this.lastChange = performance.now();
    this.ask();
  }

  redraw(): void {
    this.stale = true;
    this.ask();
  }

  private ask(): void {
    if (this.scheduled) return;
    this.scheduled = true;
    requestAnimationFrame(() => {
      this.scheduled = false;
      this.step();
    });
  }

  /** Whether the picture on the screen is the finest that there will be. */
  get settled(): boolean {
    return this.ready && !this.dirty && !this.stale && !this.job && !this.waiting && this.complete >= this.passes;
  }

  private get passes(): number {
    return this.canvas.width * this.canvas.height > MOST_PIXELS ? 1 : JITTERS.length;
  }

  private step(): void {
    if (this.gl.isContextLost() || !this.marcher.view || !this.marcher.program) return;
    if (!this.ready) {
      if (this.stale) this.draw();
      return;
    }
    if (!this.waiting) this.march();
    if (this.stale && !this.dirty) this.draw();
  }

  private march(): void {
    const [width, height] = [this.marchWidth, this.canvas.height];
    if (this.dirty) {
      this.dirty = false;
      this.complete = 0;
      this.marcher.updateTiles();
      const share = Math.min(1, Math.max(0.12, Math.sqrt(MOVING_MS / this.speed / (width * height))));
      const size: [number, number] = share > 0.95 ? [width, height] : [Math.ceil(width * share), Math.ceil(height * share)];
      this.quick = this.gpu.target(this.quick, ...size);
      this.job = { target: this.quick, jitter: [0, 0], row: 0, quick: true, started: performance.now() };
    } else if (!this.job) {
      if (this.complete >= this.passes) return;
      const idle = performance.now() - this.lastChange;
      if (idle < 120) {
        setTimeout(() => this.ask(), 125 - idle);
        return;
      }
      const i = this.complete;
      this.full[i] = this.gpu.target(this.full[i] ?? null, width, height);
      this.job = { target: this.full[i], jitter: JITTERS[i], row: 0, quick: false, started: performance.now() };
    }
    this.marchBand(this.job!);
  }

  /** The picture is two beside one another where the input stands beside the parts. */
  private get marchWidth(): number {
    return this.look.show === "beside" ? Math.floor(this.canvas.width / 2) : this.canvas.width;
  }

  private marchBand(job: Job): void {
    const { target } = job;
    const rows = job.quick ? target.height : Math.max(8, Math.floor(BAND_MS / this.speed / target.width));
    const end = Math.min(target.height, job.row + rows);
    this.marcher.rows(target, job.jitter, job.row, end, job.quick ? "quick" : "full", this.canvas.height);
    const began = performance.now();
    const pixels = (end - job.row) * target.width;
    this.whenDone(() => {
      const spent = performance.now() - began;
      // The first frames tell of caches and clocks; later ones are believed more slowly.
      this.speed += (Math.max(spent, 0.5) / pixels - this.speed) * 0.5;
      job.row = end;
      if (this.dirty && !job.quick) this.job = null;
      else if (end >= target.height) this.finish(job);
      this.ask();
    });
  }

  private finish(job: Job): void {
    this.job = null;
    if (!job.quick) this.complete++;
    else if (job.target.width === this.marchWidth && job.target.height === this.canvas.height) {
      // It was fast enough to be the whole picture at once.
      [this.full[0], this.quick] = [job.target, this.full[0] ?? null];
      this.complete = 1;
    }
    const milliseconds = performance.now() - job.started;
    this.lastFrame = { milliseconds, pixels: job.target.width * job.target.height, quick: job.quick };
    this.draw();
  }

  private whenDone(then: () => void): void {
    const { gl } = this;
    const start = this.starts;
    const fence = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0)!;
    gl.flush();
    this.waiting = true;
    const poll = () => {
      if (gl.isContextLost() || start !== this.starts) return;
      const status = gl.clientWaitSync(fence, 0, 0);
      if (status === gl.TIMEOUT_EXPIRED) {
        setTimeout(poll, 1);
        return;
      }
      gl.deleteSync(fence);
      this.waiting = false;
      then();
    };
    setTimeout(poll, 0);
  }

  private draw(): void {
    this.stale = false;
    const known = this.complete ? this.full.slice(0, this.complete) : this.quick ? [this.quick] : [];
    this.picture.draw(this.canvas.width, this.canvas.height, known, !this.ready || !known.length);
    this.pictures++;
    this.onPicture();
  }

  // For tests, measurements and files

  /** Marches a picture at once and leaves it bound to be read. */
  marchNow(everything: boolean): void {
    this.marcher.now(this.marchWidth, this.canvas.height, everything);
  }

  distances(points: Float32Array): Float32Array {
    return this.marcher.distances(points);
  }

  /** A whole picture from numbers to pixels, at once; milliseconds. */
  frameNow(): number {
    const began = performance.now();
    this.marcher.setProgram(this.marcher.program!);
    const target = this.marcher.now(this.marchWidth, this.canvas.height, false);
    this.picture.draw(this.canvas.width, this.canvas.height, [target], false);
    const pixel = new Uint8Array(4);
    this.gl.readPixels(0, 0, 1, 1, this.gl.RGBA, this.gl.UNSIGNED_BYTE, pixel);
    this.gpu.drop(target);
    return performance.now() - began;
  }

  /** The picture as it stands, as a PNG. */
  async png(): Promise<Blob> {
    this.draw();
    return new Promise((resolve, reject) =>
      this.canvas.toBlob((blob) => (blob ? resolve(blob) : reject(new Error("the browser made no picture"))), "image/png"),
    );
  }
}
