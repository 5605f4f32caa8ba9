/** Which instructions matter in which tile of the picture, and between which distances: most see few parts. */

import { INTERSECTION, LEAF, POP, type Program, PUSH, type Scope, SUBTRACT, UNION } from "../model/program";
import { type Vec3, distance, dot, sub } from "../model/vectors";
import type { View } from "./camera";

const ROWS = 40;
/** Indices a row of the list's texture. */
export const LISTED = 2048;

export interface Tiles {
  columns: number;
  rows: number;
  /** Four a tile: where its list begins, its length (and in the top bit whether a part is bent), nearest, farthest. */
  heads: Uint32Array;
  list: Uint16Array;
}

export function cull(program: Program, view: View): Tiles {
  const columns = Math.max(1, Math.round((ROWS * view.half[0]) / view.half[1]));
  const count = columns * ROWS;
  const masks = new Map<Scope, Uint8Array>();
  const all = new Uint8Array(count).fill(1);
  const visible = (scope: Scope) => (scope.hull ? covered(scope.hull, scope.reach, view, columns) : all);

  const up = (scope: Scope): Uint8Array => {
    const inner = scope.children.map(up);
    let mask = scope.children.length ? new Uint8Array(count) : visible(scope);
    if (scope.operation === UNION && inner.length) for (const one of inner) for (let i = 0; i < count; i++) mask[i] |= one[i];
    if (scope.operation === SUBTRACT && inner.length) mask.set(inner[0]);
    if (scope.operation === INTERSECTION && inner.length) {
      mask = visible(scope).slice();
      for (const one of inner) for (let i = 0; i < count; i++) mask[i] &= one[i];
    }
    masks.set(scope, mask);
    return mask;
  };
  up(program.scope);

  const byInstruction: (Uint8Array | null)[] = new Array(program.count).fill(null);
  const ranges: ([number, number] | null)[] = new Array(program.count).fill(null);
  const down = (scope: Scope, mask: Uint8Array, positive: boolean, hull: Vec3[] | null, reach: number): void => {
    byInstruction[scope.first] = byInstruction[scope.last] = mask;
    const own = scope.hull ?? hull;
    if (!scope.children.length && scope.first === scope.last && positive)
      ranges[scope.first] = range(own, Math.max(reach, scope.reach), view.eye);
    for (const [i, child] of scope.children.entries()) {
      let inner = masks.get(child)!;
      if (scope.operation === INTERSECTION) inner = mask;
      else for (let k = 0; k < count; k++) inner[k] &= mask[k];
      down(child, inner, positive && !(scope.operation === SUBTRACT && i > 0), own, Math.max(reach, scope.reach));
    }
  };
  // What starts from nothing needs no push: the fold does so anyway.
  down(program.scope, masks.get(program.scope)!, true, null, 0);
  if (program.scope.operation !== INTERSECTION) byInstruction[program.scope.first] = byInstruction[program.scope.last] = null;

  const lengths = new Uint32Array(count);
  byInstruction.forEach((mask, instruction) => {
    const entries = program.instructions[instruction].action === PUSH ? 2 : 1;
    if (mask) for (let i = 0; i < count; i++) lengths[i] += entries * mask[i];
  });
  const heads = new Uint32Array(count * 4);
  const floats = new Float32Array(heads.buffer);
  let total = 0;
  for (let i = 0; i < count; i++) {
    heads[4 * i] = total;
    total += lengths[i];
    floats[4 * i + 2] = 1e9;
  }
  const list = new Uint16Array(Math.max(1, Math.ceil(total / LISTED)) * LISTED);
  const open: Uint32Array[] = []; // where the lengths of the groups stand that are not over yet
  byInstruction.forEach((mask, instruction) => {
    if (!mask) return;
    const seen = ranges[instruction];
    const { action } = program.instructions[instruction];
    const bent = program.bent[instruction] ? 0x80000000 : 0;
    if (action === PUSH) open.push(new Uint32Array(count));
    const lengthsAt = action === LEAF ? null : action === PUSH ? open.at(-1)! : open.pop()!;
    for (let i = 0; i < count; i++) {
      if (!mask[i]) continue;
      const at = 4 * i;
      let next = heads[at] + (heads[at + 1] & 0xffff);
      list[next++] = instruction;
      if (action === PUSH) lengthsAt![i] = next++;
      if (action === POP) list[lengthsAt![i]] = next - lengthsAt![i] - 1;
      heads[at + 1] = ((next - heads[at]) | (heads[at + 1] & 0x80000000) | bent) >>> 0;
      if (!seen) continue;
      floats[at + 2] = Math.min(floats[at + 2], seen[0]);
      floats[at + 3] = Math.max(floats[at + 3], seen[1]);
    }
  });
  return { columns, rows: ROWS, heads, list };
}

/** All instructions, as the list of one tile. */
export function wholeList(program: Program): Uint16Array {
  const list: number[] = [];
  const open: number[] = [];
  program.instructions.forEach(({ action }, i) => {
    list.push(i);
    if (action === PUSH) open.push(list.push(0) - 1);
    if (action === POP) {
      const at = open.pop()!;
      list[at] = list.length - at - 1;
    }
  });
  return Uint16Array.from(list);
}

const EVERYWHERE: Vec3[] = [
  [-4, -4, -4],
  [4, 4, 4],
];

/** Nearest and farthest distance from the eye at which something of the hull may be. */
function range(hull: Vec3[] | null, reach: number, eye: Vec3): [number, number] {
  let [near, far] = [0, 0];
  for (let axis = 0; axis < 3; axis++) {
    let [low, high] = [Infinity, -Infinity];
    for (const p of hull ?? EVERYWHERE) {
      low = Math.min(low, p[axis]);
      high = Math.max(high, p[axis]);
    }
    const off = Math.max(low - eye[axis], eye[axis] - high, 0);
    near += off * off;
  }
  for (const p of hull ?? EVERYWHERE) far = Math.max(far, distance(p, eye));
  return [Math.max(Math.sqrt(near) - reach, 0), far + reach];
}

/** 1 for each tile that a convex hull, grown by `reach`, may cover. */
function covered(hull: Vec3[], reach: number, view: View, columns: number): Uint8Array {
  const mask = new Uint8Array(columns * ROWS);
  let nearest = Infinity;
  const flat: [number, number][] = [];
  for (const p of hull) {
    const v = sub(p, view.eye);
    const depth = -dot(v, view.back);
    nearest = Math.min(nearest, depth);
    const x = dot(v, view.right) / (depth * view.half[0]);
    const y = dot(v, view.up) / (depth * view.half[1]);
    flat.push([((x + 1) / 2) * columns, ((y + 1) / 2) * ROWS]);
  }
  nearest -= 2 * reach;
  if (nearest < 0.01) return mask.fill(1);
  // A twentieth of a tile for the pixels' own size.
  const grow: [number, number] = [
    0.05 + ((reach / nearest / view.half[0]) * columns) / 2,
    0.05 + ((reach / nearest / view.half[1]) * ROWS) / 2,
  ];
  const outline = convexHull(flat);
  const xs = flat.map((p) => p[0]);
  const ys = flat.map((p) => p[1]);
  const left = Math.max(0, Math.floor(Math.min(...xs) - grow[0]));
  const right = Math.min(columns - 1, Math.floor(Math.max(...xs) + grow[0]));
  const bottom = Math.max(0, Math.floor(Math.min(...ys) - grow[1]));
  const top = Math.min(ROWS - 1, Math.floor(Math.max(...ys) + grow[1]));
  const edges = outline.map((a, i) => {
    const b = outline[(i + 1) % outline.length];
    const n = [b[1] - a[1], a[0] - b[0]]; // outwards, where the outline runs counterclockwise
    const most = n[0] * a[0] + n[1] * a[1] + Math.abs(n[0]) * grow[0] + Math.abs(n[1]) * grow[1];
    return [n[0], n[1], most - Math.min(n[0], 0) - Math.min(n[1], 0)];
  });
  for (let y = bottom; y <= top; y++)
    for (let x = left; x <= right; x++) if (edges.every(([a, b, most]) => a * x + b * y <= most)) mask[y * columns + x] = 1;
  return mask;
}

/** Counterclockwise (Andrew's monotone chain). */
function convexHull(points: [number, number][]): [number, number][] {
  const sorted = [...points].sort((a, b) => a[0] - b[0] || a[1] - b[1]);
  const chain = (given: [number, number][]) => {
    const result: [number, number][] = [];
    for (const p of given) {
      while (result.length > 1) {
        const [a, b] = [result[result.length - 2], result[result.length - 1]];
        if ((b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]) > 0) break;
        result.pop();
      }
      result.push(p);
    }
    return result.slice(0, -1);
  };
  return [...chain(sorted), ...chain(sorted.reverse())];
}
