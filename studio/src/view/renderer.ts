/**
 * Draws a program of parts: rays are marched into a buffer of distance, normal, colour and part, from which a
 * second pass makes the picture. Numbers are uploaded, shaders are compiled once.
 */

import { type Program, table, TEXELS } from "../model/program";
import type { Vec3 } from "../model/vectors";
import type { View } from "./camera";
import fieldSource from "./shaders/field.glsl?raw";
import marchSource from "./shaders/march.frag?raw";
import meshFragment from "./shaders/mesh.frag?raw";
import meshVertex from "./shaders/mesh.vert?raw";
import pictureSource from "./shaders/picture.frag?raw";
import probeSource from "./shaders/probe.frag?raw";
import screenSource from "./shaders/screen.vert?raw";
import shadeSource from "./shaders/shade.frag?raw";
import { cull, LISTED, wholeList } from "./tiles";

const HEAD = "#version 300 es\nprecision highp float;\nprecision highp int;\nprecision highp sampler2D;\nprecision highp usampler2D;\n";
const JITTERS: [number, number][] = [
  [0, 0],
  [-0.375, 0.125],
  [0.125, 0.375],
  [0.375, -0.125],
];
const MOVING_MS = 40; // what a frame may take while something moves
const BLOCKS = 2; // a side of a tile: rays of one block start together
const BAND_MS = 60; // what is marched before the page gets its turn
const MOST_PIXELS = 2_000_000; // of pictures that are smoothed

export interface Mesh {
  /** Nine floats a corner: place and normal in the unit frame, and as bytes the colour and part + 1. */
  places: Float32Array;
  normals: Float32Array;
  colours: Uint8Array;
  triangles: Uint32Array;
}

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

interface Uploaded {
  array: WebGLVertexArrayObject;
  buffers: WebGLBuffer[];
  count: number;
}

interface Target {
  frame: WebGLFramebuffer;
  texture: WebGLTexture;
  depth: WebGLRenderbuffer | null;
  width: number;
  height: number;
}

interface Job {
  target: Target;
  jitter: [number, number];
  row: number;
  quick: boolean;
  started: number;
}

class Shader {
  private places = new Map<string, WebGLUniformLocation | null>();
  constructor(
    private gl: WebGL2RenderingContext,
    readonly program: WebGLProgram,
  ) {}
  at(name: string): WebGLUniformLocation | null {
    if (!this.places.has(name)) this.places.set(name, this.gl.getUniformLocation(this.program, name));
    return this.places.get(name)!;
  }
}

export class NoWebGL extends Error {}

export class Renderer {
  /** How many shaders have been compiled. */
  compilations = 0;
  /** How many times numbers of parts were uploaded. */
  uploads = 0;
  /** Of the last whole picture: milliseconds, pixels, passes. */
  lastFrame = { milliseconds: 0, pixels: 0, quick: true };
  pictures = 0;
  /** Told once after each picture. */
  onPicture: () => void = () => {};
  onReady: () => void = () => {};
  look: Look;
  ready = false;
  readonly gl: WebGL2RenderingContext;
  private shaders = new Map<string, Shader>();
  private marching: [string, WebGLProgram][] = [];
  private marched: { quick: Target | null; full: Target | null } = { quick: null, full: null };
  private textures = new Map<string, WebGLTexture>();
  private program: Program | null = null;
  private view: View | null = null;
  private cones: Target | null = null;
  private tileCount: [number, number] = [1, 1];
  private meshes: { input: Uploaded | null; standIn: Uploaded | null } = { input: null, standIn: null };
  private quick: Target | null = null;
  private full: Target[] = [];
  private complete = 0; // of `full`
  private meshTarget: Target | null = null;
  private meshDirty = true;
  private meshStands = false; // whether what was drawn last stands in for the parts
  private tilesDirty = true;
  private dirty = true; // what the rays find has changed
  private marked = false; // whether anything is selected or hovered
  private stale = true; // the picture has to be made anew
  private job: Job | null = null;
  private waiting = false;
  private speed = 2e-4; // milliseconds a pixel
  private lastChange = 0;
  private scheduled = false;

  constructor(
    readonly canvas: HTMLCanvasElement,
    look: Look,
  ) {
    this.look = look;
    const gl = canvas.getContext("webgl2", { antialias: false, alpha: false, powerPreference: "high-performance" });
    if (!gl) throw new NoWebGL("This browser offers no WebGL 2.");
    this.gl = gl;
    canvas.addEventListener("webglcontextlost", (event) => event.preventDefault());
    canvas.addEventListener("webglcontextrestored", () => this.start());
    this.start();
  }

  private start(): void {
    this.ready = false;
    this.shaders.clear();
    this.textures.clear();
    this.meshes = { input: null, standIn: null };
    this.quick = this.meshTarget = this.nothing = this.cones = null;
    this.marched = { quick: null, full: null };
    this.full = [];
    this.complete = 0;
    this.job = null;
    this.waiting = false;
    const { gl } = this;
    gl.disable(gl.DITHER);
    const parallel = gl.getExtension("KHR_parallel_shader_compile");
    this.marching = [
      ["march", this.build(screenSource, fieldSource + marchSource)],
      ["shade", this.build(screenSource, fieldSource + shadeSource)],
    ];
    this.linked("picture", this.build(screenSource, pictureSource));
    this.linked("mesh", this.build(meshVertex, meshFragment.replace(/uHeat == 1 \? .*? : vColour/, "vColour")));
    const poll = () => {
      const done = ([, program]: [string, WebGLProgram]) => !parallel || gl.getProgramParameter(program, parallel.COMPLETION_STATUS_KHR);
      if (!this.marching.every(done) && !gl.isContextLost()) {
        setTimeout(poll, 16);
        return;
      }
      for (const [name, program] of this.marching) this.linked(name, program);
      this.ready = true;
      this.dirty = this.tilesDirty = this.stale = true;
      if (this.program) this.setProgram(this.program);
      this.onReady();
      this.ask();
    };
    setTimeout(poll, 0);
  }

  private build(vertex: string, fragment: string): WebGLProgram {
    const { gl } = this;
    const program = gl.createProgram()!;
    for (const [kind, source] of [
      [gl.VERTEX_SHADER, vertex],
      [gl.FRAGMENT_SHADER, fragment],
    ] as const) {
      const shader = gl.createShader(kind)!;
      gl.shaderSource(shader, HEAD + source);
      gl.compileShader(shader);
      gl.attachShader(program, shader);
      this.compilations++;
    }
    gl.linkProgram(program);
    return program;
  }

  private linked(name: string, program: WebGLProgram): Shader {
    const { gl } = this;
    if (!gl.getProgramParameter(program, gl.LINK_STATUS) && !gl.isContextLost()) {
      const logs = (gl.getAttachedShaders(program) ?? []).map((s) => gl.getShaderInfoLog(s)).join("\n");
      throw new NoWebGL(`The graphics driver refuses a shader: ${logs}${gl.getProgramInfoLog(program)}`);
    }
    const shader = new Shader(gl, program);
    this.shaders.set(name, shader);
    return shader;
  }

  /** Compiled when it is needed first. */
  private rare(name: "probe" | "heat"): Shader {
    const known = this.shaders.get(name);
    if (known) return known;
    if (name === "probe") return this.linked(name, this.build(screenSource, fieldSource + probeSource));
    return this.linked(name, this.build(meshVertex, fieldSource + meshFragment));
  }

  setProgram(program: Program): void {
    this.program = program;
    const { gl } = this;
    const rows = Math.max(1, Math.ceil(program.count / 64));
    const data = new Float32Array(rows * 64 * TEXELS * 4);
    data.set(table(program));
    this.upload("uTable", gl.RGBA32F, 64 * TEXELS, rows, gl.RGBA, gl.FLOAT, data);
    this.uploads++;
    this.tilesDirty = true;
    this.meshDirty ||= this.look.heat;
    this.changed();
  }

  /** rgb from 0 to 1 of each part. */
  setColours(colours: Vec3[]): void {
    const rows = Math.max(1, Math.ceil(colours.length / 256));
    const data = new Uint8Array(rows * 1024);
    colours.forEach((c, i) => data.set([...c.map((v) => Math.round(v * 255)), 255], i * 4));
    this.upload("uColours", this.gl.RGBA8, 256, rows, this.gl.RGBA, this.gl.UNSIGNED_BYTE, data);
    this.changed();
  }

  /** Of each part: 1 selected, 2 hovered, 4 faded. */
  setMarks(marks: Uint8Array): void {
    const rows = Math.max(1, Math.ceil(marks.length / 256));
    const data = new Uint8Array(rows * 256);
    data.set(marks);
    this.marked = marks.some((mark) => (mark & 3) > 0);
    this.upload("uMarks", this.gl.R8UI, 256, rows, this.gl.RED_INTEGER, this.gl.UNSIGNED_BYTE, data);
    this.redraw();
  }

  setView(view: View): void {
    this.view = view;
    this.tilesDirty = this.meshDirty = true;
    this.changed();
  }

  setMesh(which: "input" | "standIn", mesh: Mesh | null): void {
    const { gl } = this;
    const old = this.meshes[which];
    if (old) {
      gl.deleteVertexArray(old.array);
      for (const buffer of old.buffers) gl.deleteBuffer(buffer);
    }
    this.meshes[which] = mesh && this.uploadMesh(mesh);
    this.meshDirty = true;
    this.redraw();
  }

  get hasInput(): boolean {
    return this.meshes.input !== null;
  }

  private uploadMesh(mesh: Mesh): Uploaded {
    const { gl } = this;
    const array = gl.createVertexArray()!;
    gl.bindVertexArray(array);
    const buffers: WebGLBuffer[] = [];
    const fill = (target: number, data: ArrayBufferView) => {
      const buffer = gl.createBuffer()!;
      gl.bindBuffer(target, buffer);
      gl.bufferData(target, data, gl.STATIC_DRAW);
      buffers.push(buffer);
    };
    fill(gl.ARRAY_BUFFER, mesh.places);
    gl.enableVertexAttribArray(0);
    gl.vertexAttribPointer(0, 3, gl.FLOAT, false, 0, 0);
    fill(gl.ARRAY_BUFFER, mesh.normals);
    gl.enableVertexAttribArray(1);
    gl.vertexAttribPointer(1, 3, gl.FLOAT, false, 0, 0);
    fill(gl.ARRAY_BUFFER, mesh.colours);
    gl.enableVertexAttribArray(2);
    gl.vertexAttribPointer(2, 4, gl.UNSIGNED_BYTE, true, 0, 0);
    fill(gl.ELEMENT_ARRAY_BUFFER, mesh.triangles);
    gl.bindVertexArray(null);
    return { array, buffers, count: mesh.triangles.length };
  }

  setLook(changes: Partial<Look>): void {
    this.look = { ...this.look, ...changes };
    this.meshDirty = true;
    this.redraw();
  }

  resize(): void {
    const ratio = Math.min(window.devicePixelRatio || 1, 2);
    const width = Math.max(1, Math.round(this.canvas.clientWidth * ratio));
    const height = Math.max(1, Math.round(this.canvas.clientHeight * ratio));
    if (this.canvas.width === width && this.canvas.height === height) return;
    this.canvas.width = width;
    this.canvas.height = height;
    this.meshDirty = this.tilesDirty = true;
    this.changed();
  }

  get aspect(): number {
    return this.canvas.width / this.canvas.height / (this.look.show === "beside" ? 2 : 1);
  }

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
    if (this.gl.isContextLost() || !this.view || !this.program) return;
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
      this.updateTiles();
      const share = Math.min(1, Math.max(0.12, Math.sqrt(MOVING_MS / this.speed / (width * height))));
      const size: [number, number] = share > 0.95 ? [width, height] : [Math.ceil(width * share), Math.ceil(height * share)];
      this.quick = this.target(this.quick, ...size);
      this.job = { target: this.quick, jitter: [0, 0], row: 0, quick: true, started: performance.now() };
    } else if (!this.job) {
      if (this.complete >= this.passes) return;
      const idle = performance.now() - this.lastChange;
      if (idle < 120) {
        setTimeout(() => this.ask(), 125 - idle);
        return;
      }
      const i = this.complete;
      this.full[i] = this.target(this.full[i] ?? null, width, height);
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
    this.marchRows(target, job.jitter, job.row, end, job.quick ? "quick" : "full");
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

  /** How far blocks of pixels can go at once: what the rays then begin with. */
  private marchCones(): void {
    const { gl } = this;
    const [width, height] = this.tileCount.map((n) => n * BLOCKS);
    this.cones = this.target(this.cones, width, height, gl.R32UI);
    const unused = this.empty();
    const shader = this.use("march");
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.cones.frame);
    gl.disable(gl.SCISSOR_TEST);
    gl.viewport(0, 0, width, height);
    this.field(shader);
    this.texture(shader, "uTiles", 3);
    this.bind(shader, "uBegin", 4, unused.texture);
    this.camera(shader);
    gl.uniform2f(shader.at("uSize"), width, height);
    gl.uniform2f(shader.at("uJitter"), 0, 0);
    gl.uniform2f(shader.at("uTileCount"), ...this.tileCount);
    // Half a block's diagonal, and a pixel for those that are smoothed.
    const { half } = this.view!;
    const radius = Math.hypot(half[0] / width, half[1] / height) + (2 * half[1]) / this.canvas.height;
    gl.uniform1f(shader.at("uCone"), radius);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
  }

  private marchRows(target: Target, jitter: [number, number], from: number, to: number, pass: "quick" | "full"): void {
    const { gl } = this;
    const marched = this.target(this.marched[pass], target.width, target.height, gl.R32UI);
    this.marched[pass] = marched;
    if (from === 0) this.marchCones();
    gl.viewport(0, 0, target.width, target.height);
    gl.enable(gl.SCISSOR_TEST);
    gl.scissor(0, from, target.width, to - from);
    for (const [name, into] of [
      ["march", marched],
      ["shade", target],
    ] as const) {
      const shader = this.use(name);
      gl.bindFramebuffer(gl.FRAMEBUFFER, into.frame);
      this.field(shader);
      this.texture(shader, "uTiles", 3);
      this.camera(shader);
      gl.uniform2f(shader.at("uSize"), target.width, target.height);
      gl.uniform2f(shader.at("uJitter"), ...jitter);
      gl.uniform2f(shader.at("uTileCount"), ...this.tileCount);
      if (name === "shade") this.bind(shader, "uMarched", 4, marched.texture);
      else this.bind(shader, "uBegin", 4, this.cones!.texture);
      if (name === "march") gl.uniform1f(shader.at("uCone"), 0);
      gl.drawArrays(gl.TRIANGLES, 0, 3);
    }
    gl.disable(gl.SCISSOR_TEST);
  }

  /**
   * Marches a whole picture at once and leaves it bound to be read; with `everything` each ray sees all parts,
   * so that tests can tell whether leaving some out changes anything.
   */
  marchNow(everything: boolean): void {
    const { gl } = this;
    this.tilesDirty = true;
    this.updateTiles();
    if (everything) {
      const list = wholeList(this.program!);
      const heads = new Uint32Array([0, list.length | 0x80000000, 0, 0]);
      new Float32Array(heads.buffer)[3] = 60;
      this.tileCount = [1, 1];
      this.upload("uTiles", gl.RGBA32UI, 1, 1, gl.RGBA_INTEGER, gl.UNSIGNED_INT, heads);
      this.uploadList("uList", list);
    }
    const target = this.target(null, this.marchWidth, this.canvas.height);
    this.marchRows(target, [0, 0], 0, target.height, "quick");
    this.tilesDirty = true;
    gl.bindFramebuffer(gl.FRAMEBUFFER, target.frame);
  }

  /** A whole picture from numbers to pixels, at once; milliseconds. For measuring. */
  frameNow(): number {
    const began = performance.now();
    this.setProgram(this.program!);
    const target = this.target(null, this.marchWidth, this.canvas.height);
    this.updateTiles();
    this.marchRows(target, [0, 0], 0, target.height, "quick");
    this.gl.bindFramebuffer(this.gl.FRAMEBUFFER, null);
    this.compose([target], 0, 0, this.canvas.width);
    const pixel = new Uint8Array(4);
    this.gl.readPixels(0, 0, 1, 1, this.gl.RGBA, this.gl.UNSIGNED_BYTE, pixel);
    this.drop(target);
    return performance.now() - began;
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
    const fence = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0)!;
    gl.flush();
    this.waiting = true;
    const poll = () => {
      if (gl.isContextLost()) return;
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

  private updateTiles(): void {
    if (!this.tilesDirty) return;
    this.tilesDirty = false;
    const { gl } = this;
    const tiles = cull(this.program!, this.view!);
    this.tileCount = [tiles.columns, tiles.rows];
    this.upload("uTiles", gl.RGBA32UI, tiles.columns, tiles.rows, gl.RGBA_INTEGER, gl.UNSIGNED_INT, tiles.heads);
    this.uploadList("uList", tiles.list);
  }

  /** Makes the picture of what is known. */
  private draw(): void {
    this.stale = false;
    const { gl } = this;
    this.empty(); // made before anything is bound
    const known = this.complete ? this.full.slice(0, this.complete) : this.quick ? [this.quick] : [];
    const standing = !this.ready || !known.length;
    const { show } = this.look;
    if ((standing || show !== "parts") && (this.meshDirty || this.meshStands !== standing)) this.drawMesh(standing);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    const { width, height } = this.canvas;
    gl.viewport(0, 0, width, height);
    if (show === "beside") {
      const half = Math.floor(width / 2);
      this.compose([], 1, 0, half);
      this.compose(known, standing ? 1 : 0, half, half);
    } else {
      const code = standing ? 1 : { parts: 0, input: 1, both: 2, wipe: 3 }[show];
      this.compose(known, code, 0, width);
    }
    this.pictures++;
    this.onPicture();
  }

  private compose(targets: Target[], show: number, left: number, width: number): void {
    const { gl } = this;
    const shader = this.use("picture");
    const height = this.canvas.height;
    gl.viewport(left, 0, width, height);
    this.camera(shader);
    const { look } = this;
    gl.uniform1i(shader.at("uShow"), show);
    gl.uniform1f(shader.at("uWipe"), look.wipe);
    gl.uniform3f(shader.at("uPaper"), ...look.paper);
    gl.uniform3f(shader.at("uInk"), ...look.ink);
    gl.uniform3f(shader.at("uAccent"), ...look.accent);
    gl.uniform4f(shader.at("uGround"), ...look.ground);
    gl.uniform1f(shader.at("uGrid"), look.grid);
    gl.uniform1i(shader.at("uOutlines"), this.marked ? 1 : 0);
    this.texture(shader, "uMarks", 2);
    gl.enable(gl.SCISSOR_TEST);
    gl.scissor(left, 0, width, height);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.CONSTANT_ALPHA, gl.ONE_MINUS_CONSTANT_ALPHA);
    gl.uniform2f(shader.at("uSize"), width, height);
    gl.uniform2f(shader.at("uOrigin"), left, 0);
    (targets.length ? targets : [this.empty()]).forEach((target, i) => {
      gl.blendColor(0, 0, 0, 1 / (i + 1));
      gl.uniform2f(shader.at("uJitter"), ...JITTERS[i]);
      this.bind(shader, "uField", 0, target.texture);
      this.bind(shader, "uMesh", 1, (this.meshTarget ?? this.empty()).texture);
      gl.drawArrays(gl.TRIANGLES, 0, 3);
    });
    gl.disable(gl.BLEND);
    gl.disable(gl.SCISSOR_TEST);
  }

  private nothing: Target | null = null;
  private empty(): Target {
    this.nothing ??= this.target(null, 1, 1);
    return this.nothing;
  }

  private drawMesh(standIn: boolean): void {
    const { gl } = this;
    this.meshDirty = false;
    this.meshStands = standIn;
    this.meshTarget = this.target(this.meshTarget, this.marchWidth, this.canvas.height, gl.RGBA32UI, true);
    const mesh = standIn ? this.meshes.standIn : this.meshes.input;
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.meshTarget.frame);
    gl.viewport(0, 0, this.meshTarget.width, this.meshTarget.height);
    gl.clearBufferuiv(gl.COLOR, 0, [0, 0, 0, 0]);
    gl.clearBufferfv(gl.DEPTH, 0, [1]);
    if (!mesh) return;
    const heat = this.look.heat && !standIn && this.program !== null && this.ready;
    if (heat) {
      this.uploadList("uAll", wholeList(this.program!));
    }
    const shader = heat ? this.use("heat") : this.use("mesh");
    this.camera(shader);
    if (heat) {
      this.field(shader, "uAll");
      gl.uniform1i(shader.at("uHeat"), 1);
      gl.uniform1f(shader.at("uMost"), this.look.most);
      gl.uniform1i(shader.at("uCount"), wholeList(this.program!).length);
    }
    gl.enable(gl.DEPTH_TEST);
    gl.bindVertexArray(mesh.array);
    gl.drawElements(gl.TRIANGLES, mesh.count, gl.UNSIGNED_INT, 0);
    gl.bindVertexArray(null);
    gl.disable(gl.DEPTH_TEST);
  }

  /** Distances at points of the unit frame, as the shader computes them; for tests and comparisons. */
  distances(points: Float32Array): Float32Array {
    const { gl } = this;
    const program = this.program!;
    const count = points.length / 3;
    const rows = Math.ceil(count / 1024);
    const texels = new Float32Array(rows * 4096);
    for (let i = 0; i < count; i++) texels.set(points.subarray(3 * i, 3 * i + 3), 4 * i);
    const shader = this.use("probe");
    this.upload("uPoints", gl.RGBA32F, 1024, rows, gl.RGBA, gl.FLOAT, texels);
    const everything = wholeList(program);
    this.uploadList("uAll", everything);
    const target = this.target(null, 1024, rows);
    gl.bindFramebuffer(gl.FRAMEBUFFER, target.frame);
    gl.viewport(0, 0, 1024, rows);
    this.field(shader, "uAll");
    this.texture(shader, "uPoints", 3);
    gl.uniform1i(shader.at("uCount"), everything.length);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    const found = new Uint32Array(rows * 4096);
    gl.readPixels(0, 0, 1024, rows, gl.RGBA_INTEGER, gl.UNSIGNED_INT, found);
    this.drop(target);
    const values = new Float32Array(found.buffer);
    return Float32Array.from({ length: count }, (_, i) => values[4 * i]);
  }

  /** The picture as it stands, as a PNG. */
  async png(): Promise<Blob> {
    this.draw();
    return new Promise((resolve, reject) =>
      this.canvas.toBlob((blob) => (blob ? resolve(blob) : reject(new Error("the browser made no picture"))), "image/png"),
    );
  }

  private use(name: string): Shader {
    const shader = name === "probe" || name === "heat" ? this.rare(name) : this.shaders.get(name)!;
    this.gl.useProgram(shader.program);
    return shader;
  }

  private camera(shader: Shader): void {
    const { gl } = this;
    const { eye, right, up, back, half } = this.view!;
    gl.uniform3f(shader.at("uEye"), ...eye);
    gl.uniformMatrix3fv(shader.at("uAxes"), false, [...right, ...up, ...back]);
    gl.uniform4f(shader.at("uPlane"), half[0], half[1], 0, 0);
  }

  private field(shader: Shader, list = "uList"): void {
    this.texture(shader, "uTable", 0);
    this.bind(shader, "uList", 1, this.textures.get(list)!);
    this.texture(shader, "uColours", 2);
  }

  private texture(shader: Shader, name: string, place: number): void {
    this.bind(shader, name, place, this.textures.get(name)!);
  }

  private bind(shader: Shader, name: string, place: number, texture: WebGLTexture): void {
    const { gl } = this;
    gl.activeTexture(gl.TEXTURE0 + place);
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.uniform1i(shader.at(name), place);
  }

  private uploadList(name: string, list: Uint16Array): void {
    const { gl } = this;
    const rows = Math.max(1, Math.ceil(list.length / LISTED));
    const data = new Uint16Array(rows * LISTED);
    data.set(list);
    this.upload(name, gl.R16UI, LISTED, rows, gl.RED_INTEGER, gl.UNSIGNED_SHORT, data);
  }

  private upload(name: string, sort: number, width: number, height: number, format: number, type: number, data: ArrayBufferView): void {
    const { gl } = this;
    if (!this.textures.has(name)) this.textures.set(name, this.newTexture());
    gl.activeTexture(gl.TEXTURE0);
    gl.bindTexture(gl.TEXTURE_2D, this.textures.get(name)!);
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
    gl.texImage2D(gl.TEXTURE_2D, 0, sort, width, height, 0, format, type, data);
  }

  private newTexture(): WebGLTexture {
    const { gl } = this;
    const texture = gl.createTexture()!;
    gl.bindTexture(gl.TEXTURE_2D, texture);
    for (const filter of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, filter, gl.NEAREST);
    for (const wrap of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.texParameteri(gl.TEXTURE_2D, wrap, gl.CLAMP_TO_EDGE);
    return texture;
  }

  private target(old: Target | null, width: number, height: number, sort: number = this.gl.RGBA32UI, deep = false): Target {
    if (old && old.width === width && old.height === height) return old;
    if (old) this.drop(old);
    const { gl } = this;
    gl.activeTexture(gl.TEXTURE0);
    const texture = this.newTexture();
    gl.texStorage2D(gl.TEXTURE_2D, 1, sort, width, height);
    const frame = gl.createFramebuffer()!;
    gl.bindFramebuffer(gl.FRAMEBUFFER, frame);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, texture, 0);
    let depth: WebGLRenderbuffer | null = null;
    if (deep) {
      depth = gl.createRenderbuffer();
      gl.bindRenderbuffer(gl.RENDERBUFFER, depth);
      gl.renderbufferStorage(gl.RENDERBUFFER, gl.DEPTH_COMPONENT24, width, height);
      gl.framebufferRenderbuffer(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.RENDERBUFFER, depth);
    }
    gl.clearBufferuiv(gl.COLOR, 0, [0, 0, 0, 0]);
    return { frame, texture, depth, width, height };
  }

  private drop(target: Target): void {
    this.gl.deleteFramebuffer(target.frame);
    this.gl.deleteTexture(target.texture);
    if (target.depth) this.gl.deleteRenderbuffer(target.depth);
  }
}
