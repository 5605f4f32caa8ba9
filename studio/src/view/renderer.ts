/**
 * The picture: when what is marched, coarsely while something moves and finely once it rests, and how what was
 * found along the rays becomes pixels. Numbers are uploaded, shaders are compiled once.
 */

import type { Maps } from "../model/maps";
import type { Program } from "../model/program";
import type { Vec3 } from "../model/vectors";
import type { View } from "./camera";
import { Gpu, NoWebGL, type Target } from "./gpu";
import { camera, fieldSource, Marcher } from "./marcher";
import { type Mesh, MeshLayer } from "./meshes";
import meshFragment from "./shaders/mesh.frag?raw";
import meshVertex from "./shaders/mesh.vert?raw";
import pictureSource from "./shaders/picture.frag?raw";
import screenSource from "./shaders/screen.vert?raw";

const JITTERS: [number, number][] = [
  [0, 0],
  [-0.375, 0.125],
  [0.125, 0.375],
  [0.375, -0.125],
];
const MOVING_MS = 40; // what a frame may take while something moves
const BAND_MS = 60; // what is marched before the page gets its turn
const MOST_PIXELS = 2_000_000; // of pictures that are smoothed

export interface Look {
  show: "parts" | "input" | "both" | "wipe" | "beside";
  wipe: number;
  heat: boolean;
  /** Where the scale of errors ends, in the unit frame. */
  most: number;
  paper: Vec3;
  ink: Vec3;
  accent: Vec3;
  ground: [number, number, number, number];
  grid: number;
}

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
  look: Look;
  ready = false;
  readonly gl: WebGL2RenderingContext;
  private gpu: Gpu;
  private marcher: Marcher;
  private meshes: Record<"input" | "standIn" | "learned", MeshLayer>;
  private quick: Target | null = null;
  private full: Target[] = [];
  private complete = 0; // of `full`
  private dirty = true; // what the rays find has changed
  private marked = false; // whether anything is selected or hovered
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
    this.look = look;
    const gl = canvas.getContext("webgl2", { antialias: false, alpha: false, powerPreference: "high-performance" });
    if (!gl) throw new NoWebGL("This browser offers no WebGL 2.");
    this.gl = gl;
    this.gpu = new Gpu(gl);
    this.marcher = new Marcher(this.gpu);
    this.meshes = { input: new MeshLayer(this.gpu), standIn: new MeshLayer(this.gpu), learned: new MeshLayer(this.gpu) };
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
    for (const layer of Object.values(this.meshes)) layer.forget();
    this.quick = this.job = null;
    this.full = [];
    this.complete = 0;
    this.waiting = false;
    gl.disable(gl.DITHER);
    this.marcher.forget();
    const parallel = gl.getExtension("KHR_parallel_shader_compile");
    const marching = this.marcher.build();
    gpu.linked("picture", gpu.build(screenSource, pictureSource));
    gpu.linked("mesh", gpu.build(meshVertex, meshFragment.replace(/uHeat == 1 \? .*? : vColour/, "vColour")));
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

  /** layers: of each part, the number of its image; -1 where it has none. */
  setProgram(program: Program, layers?: number[]): void {
    this.marcher.setProgram(program, layers);
    if (this.look.heat) this.meshes.input.dirty = true;
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
    const { gl } = this;
    const rows = Math.max(1, Math.ceil(marks.length / 256));
    const data = new Uint8Array(rows * 256);
    data.set(marks);
    this.marked = marks.some((mark) => (mark & 3) > 0);
    this.gpu.upload("uMarks", gl.R8UI, 256, rows, gl.RED_INTEGER, gl.UNSIGNED_BYTE, data);
    this.redraw();
  }

  setView(view: View): void {
    this.marcher.setView(view);
    this.meshesChanged();
    this.changed();
  }

  setMesh(which: "input" | "standIn" | "learned", mesh: Mesh | null): void {
    this.meshes[which].set(mesh);
    this.redraw();
  }

  get hasInput(): boolean {
    return this.meshes.input.there;
  }

  setLook(changes: Partial<Look>): void {
    this.look = { ...this.look, ...changes };
    this.meshesChanged();
    this.redraw();
  }

  private meshesChanged(): void {
    for (const layer of Object.values(this.meshes)) layer.dirty = true;
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

  // How it is drawn

  private draw(): void {
    this.stale = false;
    const { gl } = this;
    this.gpu.empty(); // made before anything is bound
    const known = this.complete ? this.full.slice(0, this.complete) : this.quick ? [this.quick] : [];
    const standing = !this.ready || !known.length;
    const { show } = this.look;
    const mesh = this.meshes[standing ? "standIn" : "input"];
    if (standing || show !== "parts") this.drawMesh(mesh, this.look.heat && !standing);
    if (this.meshes.learned.there) this.drawMesh(this.meshes.learned, false);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    const { width, height } = this.canvas;
    gl.viewport(0, 0, width, height);
    if (show === "beside") {
      const half = Math.floor(width / 2);
      this.compose([], this.meshes.input, 1, 0, half);
      this.compose(known, mesh, standing ? 1 : 0, half, half);
    } else {
      const code = standing ? 1 : { parts: 0, input: 1, both: 2, wipe: 3 }[show];
      this.compose(known, mesh, code, 0, width);
    }
    this.pictures++;
    this.onPicture();
  }

  private drawMesh(layer: MeshLayer, heat: boolean): void {
    layer.draw(this.marchWidth, this.canvas.height, () => {
      const shader = heat ? this.gpu.use("heat", () => this.gpu.build(meshVertex, fieldSource + meshFragment)) : this.gpu.use("mesh");
      camera(this.gpu, shader, this.marcher.view!);
      if (!heat) return;
      this.marcher.wholeField(shader);
      this.gl.uniform1i(shader.at("uHeat"), 1);
      this.gl.uniform1f(shader.at("uMost"), this.look.most);
    });
  }

  private compose(targets: Target[], mesh: MeshLayer, show: number, left: number, width: number): void {
    const { gl, gpu, look } = this;
    const shader = gpu.use("picture");
    const { height } = this.canvas;
    gl.viewport(left, 0, width, height);
    camera(gpu, shader, this.marcher.view!);
    gl.uniform1i(shader.at("uShow"), show);
    gl.uniform1f(shader.at("uWipe"), look.wipe);
    gl.uniform3f(shader.at("uPaper"), ...look.paper);
    gl.uniform3f(shader.at("uInk"), ...look.ink);
    gl.uniform3f(shader.at("uAccent"), ...look.accent);
    gl.uniform4f(shader.at("uGround"), ...look.ground);
    gl.uniform1f(shader.at("uGrid"), look.grid);
    gl.uniform1i(shader.at("uOutlines"), this.marked ? 1 : 0);
    gpu.texture(shader, "uMarks", 2);
    gl.enable(gl.SCISSOR_TEST);
    gl.scissor(left, 0, width, height);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.CONSTANT_ALPHA, gl.ONE_MINUS_CONSTANT_ALPHA);
    gl.uniform2f(shader.at("uSize"), width, height);
    gl.uniform2f(shader.at("uOrigin"), left, 0);
    const { learned } = this.meshes;
    (targets.length ? targets : [gpu.empty()]).forEach((target, i) => {
      gl.blendColor(0, 0, 0, 1 / (i + 1));
      gl.uniform2f(shader.at("uJitter"), ...JITTERS[i]);
      gpu.bind(shader, "uField", 0, target.texture);
      gpu.bind(shader, "uMesh", 1, (mesh.target ?? gpu.empty()).texture);
      gpu.bind(shader, "uLearned", 3, ((learned.there && learned.target) || gpu.empty()).texture);
      gl.drawArrays(gl.TRIANGLES, 0, 3);
    });
    gl.disable(gl.BLEND);
    gl.disable(gl.SCISSOR_TEST);
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
    this.gl.bindFramebuffer(this.gl.FRAMEBUFFER, null);
    this.compose([target], this.meshes.input, 0, 0, this.canvas.width);
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
