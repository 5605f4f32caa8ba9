/**
 * Triangles of a program's surface by dual contouring (Ju et al. 2002): a vertex in each cell that the surface
 * passes, where the planes at its crossings meet, so that edges stay sharp. Blocks that are surely empty are skipped.
 */

import { type Maps, mapColour } from "../model/maps";
import { fold, leafDistance, programDistance } from "../model/distance";
import { INTERSECTION, LEAF, POP, PUSH, SUBTRACT, UNION, type Program } from "../model/program";
import { type Vec3, longestSide, sub } from "../model/vectors";

export interface Surface {
  places: Float32Array; // (V, 3) in the unit frame
  normals: Float32Array;
  triangles: Uint32Array;
  /** Index of the part whose surface is at each vertex. */
  owners: Uint16Array;
  /** Share of each part's colour is blended: rgb bytes (V, 3). */
  colours: Uint8Array;
}

/** rgb bytes of each part, and of those with images the image's layer. */
export interface Looks {
  colours: Uint8Array;
  layers: number[];
  maps: Maps | null;
}

const BLOCK = 4;

/** cells: along the longest side. */
export function contour(program: Program, cells: number, looks: Looks): Surface {
  const side = longestSide(program.box);
  const step = side / cells;
  const counts = sub(program.box[1], program.box[0]).map((extent) => Math.ceil(extent / step) + 4);
  const [nx, ny, nz] = counts.map((n) => Math.ceil(n / BLOCK) * BLOCK);
  const origin = program.box[0].map((low) => low - 2 * step + 0.137 * step) as Vec3;
  const f = (p: ArrayLike<number>) => programDistance(program, p[0], p[1], p[2]);
  const values = new Map<number, number>();
  const key = (x: number, y: number, z: number) => (z * (ny + 1) + y) * (nx + 1) + x;
  const value = (x: number, y: number, z: number): number => {
    const k = key(x, y, z);
    let v = values.get(k);
    if (v === undefined) {
      v = programDistance(program, origin[0] + x * step, origin[1] + y * step, origin[2] + z * step);
      values.set(k, v);
    }
    return v;
  };
  const half = (Math.sqrt(3) / 2) * BLOCK * step * 1.7; // bent parts stretch distances
  const active: [number, number, number][] = [];
  for (let z = 0; z < nz; z += BLOCK)
    for (let y = 0; y < ny; y += BLOCK)
      for (let x = 0; x < nx; x += BLOCK) {
        const centre = [x, y, z].map((v, i) => origin[i] + (v + BLOCK / 2) * step);
        if (Math.abs(f(centre)) < half) active.push([x, y, z]);
      }

  const places: number[] = [];
  const normals: number[] = [];
  const vertices = new Map<number, number>();
  const crossings = new Map<number, Float64Array>();
  const gradient = (p: Float64Array, at: number): void => {
    const e = step * 1e-2;
    let size = 0;
    for (let i = 0; i < 3; i++) {
      const q = [p[0], p[1], p[2]];
      q[i] += e;
      const high = f(q);
      q[i] -= 2 * e;
      p[at + i] = high - f(q);
      size += p[at + i] ** 2;
    }
    size = Math.sqrt(size) || 1;
    for (let i = 0; i < 3; i++) p[at + i] /= size;
  };
  /** Point and normal (6,) where the surface crosses the edge from a corner along an axis. */
  const crossing = (x: number, y: number, z: number, axis: number): Float64Array => {
    const k = key(x, y, z) * 3 + axis;
    let found = crossings.get(k);
    if (found) return found;
    found = new Float64Array(6);
    const start = [origin[0] + x * step, origin[1] + y * step, origin[2] + z * step];
    let [a, b] = [0, step];
    let va = value(x, y, z);
    let vb = value(x + (axis === 0 ? 1 : 0), y + (axis === 1 ? 1 : 0), z + (axis === 2 ? 1 : 0));
    const p = [...start];
    for (let i = 0; i < 6; i++) {
      // Regula falsi that halves now and then: fields are nearly linear near the surface, but for edges.
      const t = i % 3 === 2 ? (a + b) / 2 : a + ((b - a) * va) / (va - vb);
      p[axis] = start[axis] + t;
      const v = f(p);
      if (v < 0 === va < 0) [a, va] = [t, v];
      else [b, vb] = [t, v];
      if (Math.abs(v) < 1e-6) break;
    }
    p[axis] = start[axis] + (va === vb ? (a + b) / 2 : a + ((b - a) * va) / (va - vb));
    found.set(p);
    gradient(found, 3);
    crossings.set(k, found);
    return found;
  };

  /** Index of the vertex of a cell that the surface passes. */
  const vertex = (x: number, y: number, z: number): number => {
    const k = key(x, y, z);
    const known = vertices.get(k);
    if (known !== undefined) return known;
    const found: Float64Array[] = [];
    for (let axis = 0; axis < 3; axis++)
      for (let n = 0; n < 4; n++) {
        const c = [x, y, z];
        c[(axis + 1) % 3] += n & 1;
        c[(axis + 2) % 3] += n >> 1;
        const e = [...c];
        e[axis]++;
        if (value(c[0], c[1], c[2]) < 0 !== value(e[0], e[1], e[2]) < 0) found.push(crossing(c[0], c[1], c[2], axis));
      }
    const place = whereTheyMeet(found);
    const cell = [x, y, z];
    for (let i = 0; i < 3; i++) {
      const low = origin[i] + cell[i] * step;
      place[i] = Math.max(low, Math.min(low + step, place[i]));
    }
    const index = places.length / 3;
    places.push(place[0], place[1], place[2]);
    const own = new Float64Array([place[0], place[1], place[2], 0, 0, 0]);
    gradient(own, 3);
    normals.push(own[3], own[4], own[5]);
    vertices.set(k, index);
    return index;
  };

  const triangles: number[] = [];
  for (const [bx, by, bz] of active)
    for (let z = bz; z < bz + BLOCK; z++)
      for (let y = by; y < by + BLOCK; y++)
        for (let x = bx; x < bx + BLOCK; x++) {
          const here = value(x, y, z) < 0;
          for (let axis = 0; axis < 3; axis++) {
            const to = [x, y, z];
            to[axis]++;
            const there = value(to[0], to[1], to[2]) < 0;
            if (here === there) continue;
            const [u, v] = [(axis + 1) % 3, (axis + 2) % 3];
            const around = [
              [0, 0],
              [-1, 0],
              [-1, -1],
              [0, -1],
            ].map(([du, dv]) => {
              const c = [x, y, z];
              c[u] += du;
              c[v] += dv;
              return c;
            });
            if (around.some((c) => c.some((n) => n < 0))) continue;
            const q = around.map((c) => vertex(c[0], c[1], c[2]));
            if (!here) q.reverse();
            triangles.push(q[0], q[1], q[2], q[0], q[2], q[3]);
          }
        }
  const count = places.length / 3;
  const owners = new Uint16Array(count);
  const shades = new Uint8Array(count * 3);
  for (let i = 0; i < count; i++) {
    const found = colourAt(program, places[3 * i], places[3 * i + 1], places[3 * i + 2], looks);
    owners[i] = found.owner;
    shades.set(found.colour, 3 * i);
  }
  return {
    places: Float32Array.from(places),
    normals: Float32Array.from(normals),
    triangles: Uint32Array.from(triangles),
    owners,
    colours: shades,
  };
}

/** The point nearest to all planes, not far from their middle where they leave it free. */
function whereTheyMeet(crossings: Float64Array[]): Vec3 {
  const mean: Vec3 = [0, 0, 0];
  for (const c of crossings) for (let i = 0; i < 3; i++) mean[i] += c[i] / crossings.length;
  // (A + w 1) x = b about the mean: the weight keeps flat and straight places in the middle.
  const a = [
    [0.05, 0, 0],
    [0, 0.05, 0],
    [0, 0, 0.05],
  ];
  const b = [0, 0, 0];
  for (const c of crossings) {
    const off = (c[0] - mean[0]) * c[3] + (c[1] - mean[1]) * c[4] + (c[2] - mean[2]) * c[5];
    for (let i = 0; i < 3; i++) {
      b[i] += c[3 + i] * off;
      for (let j = 0; j < 3; j++) a[i][j] += c[3 + i] * c[3 + j];
    }
  }
  const det3 = (m: number[][]) =>
    m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) -
    m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
    m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
  const det = det3(a);
  return mean.map((v, i) => v + det3(a.map((line, r) => line.map((x, c) => (c === i ? b[r] : x)))) / det) as Vec3;
}

/** Colour (bytes) and part of the surface at a point: as the shader has them. */
export function colourAt(program: Program, x: number, y: number, z: number, looks: Looks): { colour: number[]; owner: number } {
  type State = { d: number; colour: number[]; owner: number };
  const stack: State[] = [];
  const empty = (d: number): State => ({ d, colour: [128, 128, 128], owner: 0 });
  let now = empty(1e9);
  program.instructions.forEach(({ action, operation, blend, part }, i) => {
    if (action === PUSH) {
      stack.push(now);
      now = empty(operation === INTERSECTION ? -1e9 : 1e9);
      return;
    }
    let next = now;
    if (action === POP) now = stack.pop()!;
    else if (action === LEAF) {
      const layer = program.quadrics[i] ? -1 : (looks.layers[part] ?? -1);
      const plain = () => [...looks.colours.subarray(3 * part, 3 * part + 3)];
      const colour = layer >= 0 && looks.maps ? mapColour(program, i, layer, looks.maps, x, y, z) : plain();
      next = { d: leafDistance(program, i, x, y, z), colour, owner: part };
    }
    const lead = operation === UNION ? now.d - next.d : operation === SUBTRACT ? -next.d - now.d : next.d - now.d;
    const weight = blend > 1e-9 ? Math.max(0, Math.min(1, 0.5 + (0.5 * lead) / blend)) : lead > 0 ? 1 : 0;
    now = {
      d: fold(operation, now.d, next.d, blend),
      colour: now.colour.map((c, k) => c + (next.colour[k] - c) * weight),
      owner: weight > 0.5 ? next.owner : now.owner,
    };
  });
  return { colour: now.colour, owner: now.owner };
}
