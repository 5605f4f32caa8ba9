/** Marches rays through a program of parts into targets: distance, normal, colour and part of what each ray meets. */

import type { Maps } from "../model/maps";
import type { Program } from "../model/program";
import { table, TEXELS } from "../model/table";
import type { Vec3 } from "../model/vectors";
import type { View } from "./camera";
import type { Gpu, Shader, Target } from "./gpu";
import distanceSource from "../../../partwright/export/distance.glsl?raw";
import pipeSource from "../../../partwright/export/pipe.glsl?raw";
import profileSource from "../../../partwright/export/profile.glsl?raw";
import programSource from "./shaders/field.glsl?raw";
import marchSource from "./shaders/march.frag?raw";
import probeSource from "./shaders/probe.frag?raw";
import screenSource from "./shaders/screen.vert?raw";
import shadeSource from "./shaders/shade.frag?raw";
import { cull, LISTED, wholeList } from "./tiles";

/** The field of a program, for any shader to ask. */
export const fieldSource = distanceSource + profileSource + pipeSource + programSource;

const BLOCKS = 2; // a side of a tile: rays of one block start together

export class Marcher {
  /** How many times numbers of parts were uploaded. */
  uploads = 0;
  program: Program | null = null;
  view: View | null = null;
  tilesDirty = true;
  private layers: number[] = [];
  private reliefs: number[] = [];
  private cones: Target | null = null;
  private tileCount: [number, number] = [1, 1];
  private marched: { quick: Target | null; full: Target | null } = { quick: null, full: null };

  constructor(private gpu: Gpu) {}

  /** The shaders, which are then to be linked under these names. */
  build(): [string, WebGLProgram][] {
    return [
      ["march", this.gpu.build(screenSource, fieldSource + marchSource)],
      ["shade", this.gpu.build(screenSource, fieldSource + shadeSource)],
    ];
  }

  forget(): void {
    this.cones = null;
    this.marched = { quick: null, full: null };
    this.tilesDirty = true;
    this.setMaps(null);
  }

  /** layers, reliefs: of each part, the number of its image of colours, and of normals; -1 where it has none. */
  setProgram(program: Program, layers: number[] = this.layers, reliefs: number[] = this.reliefs): void {
    this.program = program;
    [this.layers, this.reliefs] = [layers, reliefs];
    const { gl } = this.gpu;
    const numbers = table(program, layers, reliefs);
    const rows = Math.max(1, Math.ceil(numbers.length / (64 * TEXELS * 4)));
    const data = new Float32Array(rows * 64 * TEXELS * 4);
    data.set(numbers);
    this.gpu.upload("uTable", gl.RGBA32F, 64 * TEXELS, rows, gl.RGBA, gl.FLOAT, data);
    this.uploads++;
    this.tilesDirty = true;
  }

  /** rgb from 0 to 1 of each part. */
  setColours(colours: Vec3[]): void {
    const { gl } = this.gpu;
    const rows = Math.max(1, Math.ceil(colours.length / 256));
    const data = new Uint8Array(rows * 1024);
    colours.forEach((c, i) => data.set([...c.map((v) => Math.round(v * 255)), 255], i * 4));
    this.gpu.upload("uColours", gl.RGBA8, 256, rows, gl.RGBA, gl.UNSIGNED_BYTE, data);
  }

  setMaps(maps: Maps | null): void {
    if (maps?.count) this.gpu.uploadLayers("uMaps", 2 * maps.size, maps.size, maps.count, maps.data);
    else this.gpu.uploadLayers("uMaps", 2, 1, 1, new Uint8Array(8));
  }

  setView(view: View): void {
    this.view = view;
    this.tilesDirty = true;
  }

  /** The lists of parts that each tile of the picture sees. */
  updateTiles(): void {
    if (!this.tilesDirty) return;
    this.tilesDirty = false;
    const { gl } = this.gpu;
    const tiles = cull(this.program!, this.view!);
    this.tileCount = [tiles.columns, tiles.rows];
    this.gpu.upload("uTiles", gl.RGBA32UI, tiles.columns, tiles.rows, gl.RGBA_INTEGER, gl.UNSIGNED_INT, tiles.heads);
    this.gpu.uploadList("uList", tiles.list, LISTED);
  }

  /** Rows `from` to `to` of a target; height: of the picture that it is a coarser one of. */
  rows(target: Target, jitter: [number, number], from: number, to: number, pass: "quick" | "full", height: number): void {
    const { gpu } = this;
    const { gl } = gpu;
    const marched = gpu.target(this.marched[pass], target.width, target.height, gl.R32UI);
    this.marched[pass] = marched;
    if (from === 0) this.marchCones(height);
    gl.viewport(0, 0, target.width, target.height);
    gl.enable(gl.SCISSOR_TEST);
    gl.scissor(0, from, target.width, to - from);
    for (const [name, into] of [
      ["march", marched],
      ["shade", target],
    ] as const) {
      const shader = gpu.use(name);
      gl.bindFramebuffer(gl.FRAMEBUFFER, into.frame);
      this.prepare(shader, target.width, target.height, jitter);
      if (name === "shade") {
        gpu.bind(shader, "uMarched", 4, marched.texture);
        gpu.bindLayers(shader, "uMaps", 5);
      } else {
        gpu.bind(shader, "uBegin", 4, this.cones!.texture);
        gl.uniform1f(shader.at("uCone"), 0);
      }
      gl.drawArrays(gl.TRIANGLES, 0, 3);
    }
    gl.disable(gl.SCISSOR_TEST);
  }

  /** How far blocks of pixels can go at once: what the rays then begin with. */
  private marchCones(pixels: number): void {
    const { gpu } = this;
    const { gl } = gpu;
    const [width, height] = this.tileCount.map((n) => n * BLOCKS);
    this.cones = gpu.target(this.cones, width, height, gl.R32UI);
    const unused = gpu.empty();
    const shader = gpu.use("march");
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.cones.frame);
    gl.disable(gl.SCISSOR_TEST);
    gl.viewport(0, 0, width, height);
    this.prepare(shader, width, height, [0, 0]);
    gpu.bind(shader, "uBegin", 4, unused.texture);
    // Half a block's diagonal, and a pixel for those that are smoothed.
    const { half } = this.view!;
    gl.uniform1f(shader.at("uCone"), Math.hypot(half[0] / width, half[1] / height) + (2 * half[1]) / pixels);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
  }

  private prepare(shader: Shader, width: number, height: number, jitter: [number, number]): void {
    const { gl } = this.gpu;
    this.field(shader);
    this.gpu.texture(shader, "uTiles", 3);
    camera(this.gpu, shader, this.view!);
    gl.uniform2f(shader.at("uSize"), width, height);
    gl.uniform2f(shader.at("uJitter"), ...jitter);
    gl.uniform2f(shader.at("uTileCount"), ...this.tileCount);
  }

  private field(shader: Shader, list = "uList"): void {
    this.gpu.texture(shader, "uTable", 0);
    this.gpu.texture(shader, "uList", 1, list);
    this.gpu.texture(shader, "uColours", 2);
  }

  /** The field of all parts, for a shader that asks it at places of its own. */
  wholeField(shader: Shader): void {
    const everything = wholeList(this.program!);
    this.gpu.uploadList("uAll", everything, LISTED);
    this.field(shader, "uAll");
    this.gpu.gl.uniform1i(shader.at("uCount"), everything.length);
  }

  /**
   * Marches a whole picture at once and leaves it bound to be read; with `everything` each ray sees all parts,
   * so that tests can tell whether leaving some out changes anything.
   */
  now(width: number, height: number, everything: boolean): Target {
    const { gl } = this.gpu;
    this.tilesDirty = true;
    this.updateTiles();
    if (everything) {
      const list = wholeList(this.program!);
      const heads = new Uint32Array([0, list.length | 0x80000000, 0, 0]);
      new Float32Array(heads.buffer)[3] = 60;
      this.tileCount = [1, 1];
      this.gpu.upload("uTiles", gl.RGBA32UI, 1, 1, gl.RGBA_INTEGER, gl.UNSIGNED_INT, heads);
      this.gpu.uploadList("uList", list, LISTED);
    }
    const target = this.gpu.target(null, width, height);
    this.rows(target, [0, 0], 0, height, "quick", height);
    this.tilesDirty = true;
    gl.bindFramebuffer(gl.FRAMEBUFFER, target.frame);
    return target;
  }

  /** Distances at points of the unit frame, as the shader computes them; for tests and comparisons. */
  distances(points: Float32Array): Float32Array {
    const { gpu } = this;
    const { gl } = gpu;
    const count = points.length / 3;
    const rows = Math.ceil(count / 1024);
    const texels = new Float32Array(rows * 4096);
    for (let i = 0; i < count; i++) texels.set(points.subarray(3 * i, 3 * i + 3), 4 * i);
    const shader = gpu.use("probe", () => gpu.build(screenSource, fieldSource + probeSource));
    gpu.upload("uPoints", gl.RGBA32F, 1024, rows, gl.RGBA, gl.FLOAT, texels);
    const target = gpu.target(null, 1024, rows);
    gl.bindFramebuffer(gl.FRAMEBUFFER, target.frame);
    gl.viewport(0, 0, 1024, rows);
    this.wholeField(shader);
    gpu.texture(shader, "uPoints", 3);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    const found = new Uint32Array(rows * 4096);
    gl.readPixels(0, 0, 1024, rows, gl.RGBA_INTEGER, gl.UNSIGNED_INT, found);
    gpu.drop(target);
    const values = new Float32Array(found.buffer);
    return Float32Array.from({ length: count }, (_, i) => values[4 * i]);
  }
}

export function camera(gpu: Gpu, shader: Shader, view: View): void {
  const { gl } = gpu;
  const { eye, right, up, back, half } = view;
  gl.uniform3f(shader.at("uEye"), ...eye);
  gl.uniformMatrix3fv(shader.at("uAxes"), false, [...right, ...up, ...back]);
  gl.uniform4f(shader.at("uPlane"), half[0], half[1], 0, 0);
}
