/** Signed distances in double precision: for picking, snapping and meshing. The shader does the pixels. */

import { pipeDistance } from "./pipes";
import { sweptDistance } from "./profiles";
import type { Program } from "./program";
import { INTERSECTION, POP, PUSH, UNION } from "./program";

export const FAR = 1e9;

export function smoothUnion(a: number, b: number, k: number): number {
  const shared = k > 1e-9 ? Math.max(k - Math.abs(a - b), 0) : 0;
  return Math.min(a, b) - (shared > 0 ? (shared * shared) / (4 * k) : 0);
}

export function fold(operation: number, a: number, b: number, k: number): number {
  if (operation === UNION) return smoothUnion(a, b, k);
  if (operation === INTERSECTION) return -smoothUnion(-a, -b, k);
  return -smoothUnion(-a, b, k);
}

/** Of what `unbend` was asked last. */
export let unbentAcross = 0;
export let unbentAlong = 0;

/** Coordinates across and along the axis, as if its arc were straight. */
export function unbend(x: number, z: number, h: number, bulge: number): void {
  unbentAcross = x;
  unbentAlong = z;
  if (!(bulge > 0)) return;
  const theta = (bulge * Math.PI) / 2;
  const [s, k] = [Math.sin(theta), Math.cos(theta)];
  const end = Math.abs(z) - h;
  const over = x * s + end * k;
  if (over <= 0) {
    const [tx, ty] = [k * h - x * s, Math.abs(z) * s];
    unbentAcross = ((x * x + z * z - h * h) * s - 2 * x * k * h) / (Math.sqrt(tx * tx + ty * ty) + h);
    unbentAlong = (h / theta) * Math.atan2(ty, Math.max(tx, 0));
  } else {
    unbentAcross = end * s - x * k;
    unbentAlong = h + over;
  }
  if (z < 0) unbentAlong = -unbentAlong;
}

export function crossSection(x: number, y: number, hx: number, hy: number, radius: number): number {
  const qx = Math.abs(x) - hx + radius;
  const qy = Math.abs(y) - hy + radius;
  const [ox, oy] = [Math.max(qx, 0), Math.max(qy, 0)];
  return Math.sqrt(ox * ox + oy * oy) + Math.min(Math.max(qx, qy), 0) - radius;
}

/** One SuperFrustum at a point of its own frame; `at` is where its row begins. */
export function superfrustumDistance(x: number, y: number, z: number, rows: Float64Array, at: number): number {
  const sx = rows[at];
  const sy = rows[at + 1];
  const roundness = rows[at + 3];
  const dilation = rows[at + 4];
  const taper = rows[at + 5];
  const bulge = rows[at + 6];
  const onion = rows[at + 7];
  const m = Math.min(sx, sy) / 2;
  const h = rows[at + 2] / 2 + 1e-12;
  unbend(x, z, h, bulge);
  const along = unbentAlong;
  const q = crossSection(unbentAcross, y, sx / 2, sy / 2, roundness * m);
  const closed = Math.max(taper, 1) * m * onion <= dilation;
  const outerTop = m * (taper - 1);
  const outer = edge(q, along, 0, outerTop, h);
  const outerSquare = squared;
  let inner = outer;
  let innerSquare = outerSquare;
  const innerTop = m * (taper * onion - 1);
  const innerBottom = m * (onion - 1);
  if (!closed) {
    inner = -edge(q, along, innerBottom, innerTop, h);
    innerSquare = squared;
  }
  const inside = Math.max(outer, inner, Math.abs(along) - h);
  if (inside <= 0) return inside - dilation;
  let top = Math.max(q - outerTop, 0);
  let bottom = Math.max(q, 0);
  if (!closed) {
    top += Math.max(innerTop - q, 0);
    bottom += Math.max(innerBottom - q, 0);
  }
  const [up, down] = [along - h, along + h];
  return Math.sqrt(Math.min(outerSquare, innerSquare, top * top + up * up, bottom * bottom + down * down)) - dilation;
}

let squared = 0; // of the edge that was asked for last, to its segment

function edge(q: number, z: number, bottom: number, top: number, h: number): number {
  const dq = q - bottom;
  const dz = z + h;
  const lean = top - bottom;
  const rise = 2 * h;
  const square = lean * lean + rise * rise;
  const u = Math.max(0, Math.min(1, (dq * lean + dz * rise) / square));
  const [ox, oy] = [dq - u * lean, dz - u * rise];
  squared = ox * ox + oy * oy;
  return (dq * rise - dz * lean) / Math.sqrt(square);
}

/** A lower bound of the distance to a quadric (Taubin 1994); its numbers begin at `at`. */
function quadricDistance(x: number, y: number, z: number, r: Float64Array, at: number): number {
  const bx = r[at] * x + r[at + 3] * y + r[at + 5] * z;
  const by = r[at + 3] * x + r[at + 1] * y + r[at + 4] * z;
  const bz = r[at + 5] * x + r[at + 4] * y + r[at + 2] * z;
  const [lx, ly, lz] = [r[at + 6], r[at + 7], r[at + 8]];
  const value = (bx + lx) * x + (by + ly) * y + (bz + lz) * z + r[at + 9];
  const [gx, gy, gz] = [2 * bx + lx, 2 * by + ly, 2 * bz + lz];
  const steep = Math.sqrt(gx * gx + gy * gy + gz * gz);
  const size = Math.abs(value);
  const turn = (value < 0 ? r[at + 11] : r[at + 10]) * size;
  const reach = (2 * size) / Math.max(steep + Math.sqrt(Math.max(steep * steep + 4 * turn, 0)), 1e-18);
  return value < 0 ? -reach : reach;
}

/** Distance of one leaf's instruction at a point of the unit frame. */
export function leafDistance(program: Program, i: number, x: number, y: number, z: number): number {
  const { poses, rows } = program;
  const p = i * 12;
  const lx = poses[p] * x + poses[p + 1] * y + poses[p + 2] * z + poses[p + 3];
  const ly = poses[p + 4] * x + poses[p + 5] * y + poses[p + 6] * z + poses[p + 7];
  const lz = poses[p + 8] * x + poses[p + 9] * y + poses[p + 10] * z + poses[p + 11];
  const profile = program.swept[i];
  const along = program.pipes[i];
  const { scale } = program.frame;
  if (profile) return sweptDistance(profile, lx / scale, ly / scale, lz / scale) * scale;
  if (along) return pipeDistance(along, lx / scale, ly / scale, lz / scale) * scale;
  if (program.quadrics[i]) return quadricDistance(lx, ly, lz, rows, i * 12);
  return superfrustumDistance(lx, ly, lz, rows, i * 12);
}

const stack = new Float64Array(128);

/** Distance of the whole at a point of the unit frame; `only` leaves out instructions that are not in it. */
export function programDistance(
  program: Program,
  x: number,
  y: number,
  z: number,
  only?: ArrayLike<number>,
  exact = false,
): number {
  let height = 0;
  let result = FAR;
  const count = only ? only.length : program.count;
  for (let n = 0; n < count; n++) {
    const i = only ? only[n] : n;
    const { operation, action } = program.instructions[i];
    const blend = program.instructions[i].blend;
    if (action === PUSH) {
      stack[height++] = result;
      result = operation === INTERSECTION ? -FAR : FAR;
    } else if (action === POP) {
      result = fold(operation, stack[--height], result, blend);
    } else {
      // A leaf whose ball lies beyond what is there already changes nothing.
      if (!exact && operation !== INTERSECTION) {
        const b = i * 4;
        const { balls } = program;
        const [dx, dy, dz] = [x - balls[b], y - balls[b + 1], z - balls[b + 2]];
        const bound = (operation === UNION ? result : -result) + blend + balls[b + 3];
        if (bound <= 0 || dx * dx + dy * dy + dz * dz > bound * bound) continue;
      }
      result = fold(operation, result, leafDistance(program, i, x, y, z), blend);
    }
  }
  return result;
}

/** Gradient by central differences, of unit length. */
export function programNormal(program: Program, x: number, y: number, z: number, step = 1e-4): [number, number, number] {
  const d = (a: number, b: number, c: number) => programDistance(program, x + a, y + b, z + c);
  const g = [d(step, 0, 0) - d(-step, 0, 0), d(0, step, 0) - d(0, -step, 0), d(0, 0, step) - d(0, 0, -step)];
  const size = Math.hypot(...g) || 1;
  return [g[0] / size, g[1] / size, g[2] / size];
}
