/** A surface as a file. */

import { smoothNormals, type Triangles } from "../model/learned";
import { rgb } from "../model/palette";
import type { Store } from "../model/store";
import { unit } from "../model/vectors";
import type { Surface } from "./contour";

const METRES: Record<string, number> = { m: 1, dm: 0.1, cm: 0.01, mm: 1e-3, um: 1e-6, in: 0.0254, ft: 0.3048 };

/** Further triangles, in own units, each vertex in the colour of its part: shells of their own. */
export function addTriangles(surface: Surface, more: Triangles, store: Store): void {
  const { scale, offset } = store.frame;
  const first = surface.places.length / 3;
  const joined = <T extends Float32Array | Uint32Array | Uint8Array | Uint16Array>(a: T, b: T): T => {
    const result = new (a.constructor as new (n: number) => T)(a.length + b.length);
    result.set(a);
    result.set(b, a.length);
    return result;
  };
  const normals = smoothNormals(more);
  for (let i = 0; i < normals.length; i += 3) normals.set(unit([normals[i], normals[i + 1], normals[i + 2]]), i);
  const colours = store.program.parts.map((part) => rgb(store.colourOf(part)).map((v) => Math.round(v * 255)));
  surface.places = joined(surface.places, more.places.map((v, i) => v * scale + offset[i % 3]));
  surface.normals = joined(surface.normals, normals);
  surface.triangles = joined(surface.triangles, more.triangles.map((v) => v + first));
  surface.owners = joined(surface.owners, more.owners);
  surface.colours = joined(surface.colours, Uint8Array.from([...more.owners].flatMap((owner) => colours[owner])));
}

/** Binary STL in the assembly's own unit. */
export function toStl(surface: Surface, store: Store): ArrayBuffer {
  const count = surface.triangles.length / 3;
  const buffer = new ArrayBuffer(84 + 50 * count);
  const view = new DataView(buffer);
  const own = ownPlaces(surface, store);
  view.setUint32(80, count, true);
  for (let i = 0; i < count; i++) {
    const [a, b, c] = [0, 1, 2].map((k) => surface.triangles[3 * i + k] * 3);
    const [u, v] = [b, c].map((at) => [0, 1, 2].map((k) => own[at + k] - own[a + k]));
    const n = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
    const size = Math.hypot(...n) || 1;
    const at = 84 + 50 * i;
    n.forEach((x, k) => view.setFloat32(at + 4 * k, x / size, true));
    [a, b, c].forEach((from, j) => {
      for (let k = 0; k < 3; k++) view.setFloat32(at + 12 + 12 * j + 4 * k, own[from + k], true);
    });
  }
  return buffer;
}

/** glTF's colours of vertices are in linear light. */
const LINEAR = Uint8Array.from({ length: 256 }, (_, i) => Math.round(255 * (i <= 10 ? i / 255 / 12.92 : ((i / 255 + 0.055) / 1.055) ** 2.4)));

/** Binary glTF, in metres where the unit is known, with y up. */
export function toGlb(surface: Surface, store: Store): ArrayBuffer {
  const own = ownPlaces(surface, store);
  const scale = METRES[store.root.unit ?? ""] ?? 1;
  const up = store.root.up ?? "y";
  // Rotations that bring what was up to y.
  const turns: Record<string, number[]> = {
    z: [-Math.SQRT1_2, 0, 0, Math.SQRT1_2],
    "-z": [Math.SQRT1_2, 0, 0, Math.SQRT1_2],
    x: [0, 0, Math.SQRT1_2, Math.SQRT1_2],
    "-x": [0, 0, -Math.SQRT1_2, Math.SQRT1_2],
    "-y": [1, 0, 0, 0],
  };
  const count = own.length / 3;
  const colours = new Uint8Array(count * 4).fill(255);
  for (let i = 0; i < count; i++) for (let k = 0; k < 3; k++) colours[4 * i + k] = LINEAR[surface.colours[3 * i + k]];
  const places = Float32Array.from(own, (v) => v * scale);
  const chunks = [places, surface.normals, colours, surface.triangles];
  let offset = 0;
  const bufferViews = chunks.map((chunk, i) => {
    const entry = { buffer: 0, byteOffset: offset, byteLength: chunk.byteLength, target: i === 3 ? 34963 : 34962 };
    offset += chunk.byteLength;
    return entry;
  });
  const extreme = (pick: (...v: number[]) => number) =>
    [0, 1, 2].map((k) => {
      let result = places[k];
      for (let i = 1; i < count; i++) result = pick(result, places[3 * i + k]);
      return result;
    });
  const json = {
    asset: { version: "2.0", generator: "Partwright studio" },
    scene: 0,
    scenes: [{ nodes: [0] }],
    nodes: [{ mesh: 0, name: store.root.name || "assembly", ...(turns[up] ? { rotation: turns[up] } : {}) }],
    materials: [{ pbrMetallicRoughness: { metallicFactor: 0, roughnessFactor: 0.6 } }],
    meshes: [{ primitives: [{ attributes: { POSITION: 0, NORMAL: 1, COLOR_0: 2 }, indices: 3, material: 0 }] }],
    accessors: [
      { bufferView: 0, componentType: 5126, count, type: "VEC3", min: extreme(Math.min), max: extreme(Math.max) },
      { bufferView: 1, componentType: 5126, count, type: "VEC3" },
      { bufferView: 2, componentType: 5121, normalized: true, count, type: "VEC4" },
      { bufferView: 3, componentType: 5125, count: surface.triangles.length, type: "SCALAR" },
    ],
    bufferViews,
    buffers: [{ byteLength: offset }],
  };
  let text = new TextEncoder().encode(JSON.stringify(json));
  const padded = new Uint8Array(Math.ceil(text.length / 4) * 4).fill(32);
  padded.set(text);
  text = padded;
  const result = new ArrayBuffer(12 + 8 + text.length + 8 + offset);
  const view = new DataView(result);
  [0x46546c67, 2, result.byteLength, text.length, 0x4e4f534a].forEach((n, i) => view.setUint32(4 * i, n, true));
  new Uint8Array(result).set(text, 20);
  view.setUint32(20 + text.length, offset, true);
  view.setUint32(24 + text.length, 0x004e4942, true);
  let at = 28 + text.length;
  for (const chunk of chunks) {
    new Uint8Array(result).set(new Uint8Array(chunk.buffer, chunk.byteOffset, chunk.byteLength), at);
    at += chunk.byteLength;
  }
  return result;
}

function ownPlaces(surface: Surface, store: Store): Float64Array {
  const { scale, offset } = store.frame;
  return Float64Array.from(surface.places, (v, i) => (v - offset[i % 3]) / scale);
}
