/** How what was found along the rays, and meshes, become pixels. */

import type { Vec3 } from "../model/vectors";
import type { Gpu, Target } from "./gpu";
import { camera, fieldSource, type Marcher } from "./marcher";
import { MeshLayer } from "./meshes";
import meshFragment from "./shaders/mesh.frag?raw";
import meshVertex from "./shaders/mesh.vert?raw";
import pictureSource from "./shaders/picture.frag?raw";
import screenSource from "./shaders/screen.vert?raw";

/** Where in their pixels the rays of the pictures go that are laid over one another. */
export const JITTERS: [number, number][] = [
  [0, 0],
  [-0.375, 0.125],
  [0.125, 0.375],
  [0.375, -0.125],
];

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

export class Picture {
  readonly meshes: Record<"input" | "standIn" | "learned", MeshLayer>;
  private marked = false; // whether anything is selected or hovered

  constructor(
    private gpu: Gpu,
    private marcher: Marcher,
    public look: Look,
  ) {
    this.meshes = { input: new MeshLayer(gpu), standIn: new MeshLayer(gpu), learned: new MeshLayer(gpu) };
  }

  build(): void {
    const { gpu } = this;
    gpu.linked("picture", gpu.build(screenSource, pictureSource));
    gpu.linked("mesh", gpu.build(meshVertex, meshFragment.replace(/uHeat == 1 \? .*? : vColour/, "vColour")));
  }

  forget(): void {
    for (const layer of Object.values(this.meshes)) layer.forget();
  }

  /** The meshes are seen from elsewhere, or in another way. */
  changed(): void {
    for (const layer of Object.values(this.meshes)) layer.dirty = true;
  }

  /** Of each part: 1 selected, 2 hovered, 4 faded. */
  setMarks(marks: Uint8Array): void {
    const { gl } = this.gpu;
    const rows = Math.max(1, Math.ceil(marks.length / 256));
    const data = new Uint8Array(rows * 256);
    data.set(marks);
    this.marked = marks.some((mark) => (mark & 3) > 0);
    this.gpu.upload("uMarks", gl.R8UI, 256, rows, gl.RED_INTEGER, gl.UNSIGNED_BYTE, data);
  }

  /** On the screen. known: what was marched; standing: a mesh stands in for it. */
  draw(width: number, height: number, known: Target[], standing: boolean): void {
    const { gl } = this.gpu;
    this.gpu.empty(); // made before anything is bound
    const { show } = this.look;
    const each = show === "beside" ? Math.floor(width / 2) : width;
    const mesh = this.meshes[standing ? "standIn" : "input"];
    if (standing || show !== "parts") this.drawMesh(mesh, each, height, this.look.heat && !standing);
    if (show === "beside" && standing) this.drawMesh(this.meshes.input, each, height, false);
    if (this.meshes.learned.there) this.drawMesh(this.meshes.learned, each, height, false);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    if (show === "beside") {
      this.compose([], this.meshes.input, 1, 0, each, height);
      this.compose(known, mesh, standing ? 1 : 0, each, each, height);
    } else {
      const code = standing ? 1 : { parts: 0, input: 1, both: 2, wipe: 3 }[show];
      this.compose(known, mesh, code, 0, width, height);
    }
  }

  private drawMesh(layer: MeshLayer, width: number, height: number, heat: boolean): void {
    layer.draw(width, height, () => {
      const shader = heat ? this.gpu.use("heat", () => this.gpu.build(meshVertex, fieldSource + meshFragment)) : this.gpu.use("mesh");
      camera(this.gpu, shader, this.marcher.view!);
      if (!heat) return;
      this.marcher.wholeField(shader);
      this.gpu.gl.uniform1i(shader.at("uHeat"), 1);
      this.gpu.gl.uniform1f(shader.at("uMost"), this.look.most);
    });
  }

  private compose(targets: Target[], mesh: MeshLayer, show: number, left: number, width: number, height: number): void {
    const { gpu, look } = this;
    const { gl } = gpu;
    const shader = gpu.use("picture");
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
}
