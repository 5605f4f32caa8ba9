/** Triangles in the picture: the input, a mesh that stands in for the parts, and learned parts. */

import type { Gpu, Target } from "./gpu";

export interface Mesh {
  /** Three floats a vertex: place and normal in the unit frame (normals of length 0 are found by the shader). */
  places: Float32Array;
  normals: Float32Array;
  /** Four bytes a vertex: the colour and the part + 1. */
  colours: Uint8Array;
  triangles: Uint32Array;
}

interface Uploaded {
  array: WebGLVertexArrayObject;
  buffers: WebGLBuffer[];
  count: number;
}

/** One mesh, and the target that it is drawn into. */
export class MeshLayer {
  target: Target | null = null;
  dirty = true;
  private uploaded: Uploaded | null = null;

  constructor(private gpu: Gpu) {}

  get there(): boolean {
    return this.uploaded !== null;
  }

  forget(): void {
    this.target = this.uploaded = null;
    this.dirty = true;
  }

  set(mesh: Mesh | null): void {
    const { gl } = this.gpu;
    if (this.uploaded) {
      gl.deleteVertexArray(this.uploaded.array);
      for (const buffer of this.uploaded.buffers) gl.deleteBuffer(buffer);
    }
    this.uploaded = mesh && upload(gl, mesh);
    this.dirty = true;
  }

  /** Draws it, where something has changed. prepare: sets the shader and its numbers. */
  draw(width: number, height: number, prepare: () => void): void {
    const { gl } = this.gpu;
    if (!this.dirty && this.target?.width === width && this.target.height === height) return;
    this.dirty = false;
    this.target = this.gpu.target(this.target, width, height, gl.RGBA32UI, true);
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.target.frame);
    gl.viewport(0, 0, width, height);
    gl.clearBufferuiv(gl.COLOR, 0, [0, 0, 0, 0]);
    gl.clearBufferfv(gl.DEPTH, 0, [1]);
    if (!this.uploaded) return;
    prepare();
    gl.enable(gl.DEPTH_TEST);
    gl.bindVertexArray(this.uploaded.array);
    gl.drawElements(gl.TRIANGLES, this.uploaded.count, gl.UNSIGNED_INT, 0);
    gl.bindVertexArray(null);
    gl.disable(gl.DEPTH_TEST);
  }
}

function upload(gl: WebGL2RenderingContext, mesh: Mesh): Uploaded {
  const array = gl.createVertexArray()!;
  gl.bindVertexArray(array);
  const buffers: WebGLBuffer[] = [];
  const fill = (target: number, data: ArrayBufferView) => {
    const buffer = gl.createBuffer()!;
    gl.bindBuffer(target, buffer);
    gl.bufferData(target, data, gl.STATIC_DRAW);
    buffers.push(buffer);
  };
  const attribute = (place: number, data: ArrayBufferView, size: number, type: number, normalise: boolean) => {
    fill(gl.ARRAY_BUFFER, data);
    gl.enableVertexAttribArray(place);
    gl.vertexAttribPointer(place, size, type, normalise, 0, 0);
  };
  attribute(0, mesh.places, 3, gl.FLOAT, false);
  attribute(1, mesh.normals, 3, gl.FLOAT, false);
  attribute(2, mesh.colours, 4, gl.UNSIGNED_BYTE, true);
  fill(gl.ELEMENT_ARRAY_BUFFER, mesh.triangles);
  gl.bindVertexArray(null);
  return { array, buffers, count: mesh.triangles.length };
}
