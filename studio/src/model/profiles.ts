/** Extrusions and revolutions: profiles of lines and arcs, moved along z or turned about it. */

import type { FieldData } from "./fields";
import type { Box } from "./vectors";

/** One line or arc: numbers in the order in which the table of the shader has them. */
export interface Side {
  start: [number, number];
  end: [number, number];
  centre: [number, number];
  /** 0 of a line. */
  radius: number;
  /** From the centre to the arc's middle, and the cosine of half its angle. */
  middle: [number, number];
  cosine: number;
  /** Where an arc runs between two heights, on the right (1) or left (0) of its centre. */
  pieces: [number, number, number][];
  /** On the axis of a revolution, whose side it does not bound. */
  onAxis: boolean;
}

export interface Swept {
  sides: Side[];
  turned: boolean;
  /** Of an extrusion. */
  height: number;
  /** Radians: of an extrusion its taper, of a revolution its angle. */
  angle: number;
  /** Of an extrusion, in own lengths: fillet and chamfer at the bottom, fillet and chamfer at the top. */
  rims: number[];
}

/** The names of the rims in a file, in that order. */
export const RIMS = ["bottom_fillet", "bottom_chamfer", "top_fillet", "top_chamfer"];

export const hasRims = (of: Swept): boolean => of.rims.some((v) => v > 0);

type Corner = [number, number, number?];

export const isSwept = (field: FieldData): boolean => field.kind === "extrusion" || field.kind === "revolution";

export const loops = (field: FieldData): Corner[][] => {
  const profile = field.profile as unknown as { outline: Corner[]; holes?: Corner[][] };
  return [profile.outline, ...(profile.holes ?? [])];
};

/** The field with other corners. */
export function withLoops(field: FieldData, move: (corner: Corner) => Corner): FieldData {
  const [outline, ...holes] = loops(field).map((loop) => loop.map(move));
  return { ...field, profile: (holes.length ? { outline, holes } : { outline }) as never };
}

const known = new WeakMap<object, Swept>();

/** What distances are made of; null for any other kind. */
export function swept(field: FieldData): Swept | null {
  if (!isSwept(field)) return null;
  const found = known.get(field);
  if (found) return found;
  const turned = field.kind === "revolution";
  const degrees = Number(turned ? (field.angle ?? 360) : (field.taper ?? 0));
  const sides = loops(field).flatMap((loop) => loop.map((corner, i) => side(corner, loop[(i + 1) % loop.length], turned)));
  const rims = turned ? [0, 0, 0, 0] : RIMS.map((name) => Number(field[name] ?? 0));
  const made = { sides, turned, height: Number(field.height ?? 0), angle: (degrees * Math.PI) / 180, rims };
  known.set(field, made);
  return made;
}

function side([ax, ay, bulge = 0]: Corner, [bx, by]: Corner, turned: boolean): Side {
  const line: Side = {
    start: [ax, ay],
    end: [bx, by],
    centre: [0, 0],
    radius: 0,
    middle: [0, 0],
    cosine: 0,
    pieces: [],
    onAxis: turned && ax === 0 && bx === 0,
  };
  if (bulge === 0) return line;
  const [vx, vy] = [(bx - ax) / 2, (by - ay) / 2];
  const k = (1 - bulge * bulge) / (2 * bulge);
  const half = Math.hypot(vx, vy);
  const [cx, cy] = [(ax + bx) / 2 - k * vy, (ay + by) / 2 + k * vx];
  const radius = (half * (1 + bulge * bulge)) / (2 * Math.abs(bulge));
  const sweep = 4 * Math.atan(bulge);
  const begin = Math.atan2(ay - cy, ax - cx);
  const [low, high] = sweep > 0 ? [begin, begin + sweep] : [begin + sweep, begin];
  const levels = Array.from({ length: 9 }, (_, i) => Math.PI * (i - 3.5)).filter((level) => level > low && level < high);
  const cuts = [low, ...levels, high];
  const heights = cuts.map((cut) => cy + radius * Math.round(Math.sin(cut)));
  heights[0] = sweep > 0 ? ay : by;
  heights[heights.length - 1] = sweep > 0 ? by : ay;
  const pieces: [number, number, number][] = [];
  for (let i = 0; i + 1 < cuts.length; i++) {
    const [one, other] = [heights[i], heights[i + 1]];
    const right = Math.cos((cuts[i] + cuts[i + 1]) / 2) > 0 ? 1 : 0;
    if (one !== other) pieces.push([Math.min(one, other), Math.max(one, other), right]);
  }
  const to = Math.sign(bulge) / half;
  return { ...line, centre: [cx, cy], radius, middle: [vy * to, -vx * to], cosine: Math.cos(sweep / 2), pieces, onAxis: false };
}

/** Signed distance in the plane; axis: whether sides on the axis count. */
function profileDistance(sides: Side[], x: number, y: number, axis: boolean): number {
  let square = 1e30;
  let inside = false;
  for (const s of sides) {
    if (s.onAxis && !axis) continue;
    const [ox, oy] = [x - s.start[0], y - s.start[1]];
    const [ex, ey] = [x - s.end[0], y - s.end[1]];
    if (s.radius === 0) {
      const [wx, wy] = [s.end[0] - s.start[0], s.end[1] - s.start[1]];
      const share = Math.min(1, Math.max(0, (ox * wx + oy * wy) / (wx * wx + wy * wy)));
      square = Math.min(square, (ox - share * wx) ** 2 + (oy - share * wy) ** 2);
      if (s.start[1] <= y !== s.end[1] <= y && x < s.start[0] + (oy / wy) * wx) inside = !inside;
      continue;
    }
    const [cx, cy] = [x - s.centre[0], y - s.centre[1]];
    const reach = Math.hypot(cx, cy);
    const within = cx * s.middle[0] + cy * s.middle[1] >= reach * s.cosine;
    square = Math.min(square, within ? (reach - s.radius) ** 2 : Math.min(ox * ox + oy * oy, ex * ex + ey * ey));
    for (const [low, high, right] of s.pieces) {
      if (!(low <= y && y < high)) continue;
      if (right ? cx < 0 || reach < s.radius : cx < 0 && reach >= s.radius) inside = !inside;
    }
  }
  return inside ? -Math.sqrt(square) : Math.sqrt(square);
}

/** Of the corner between a wall and an end, u and v beyond them: rounded, or else cut off at 45 degrees. */
function rimDistance(u: number, v: number, fillet: number, chamfer: number): number {
  if (fillet > 0) {
    const [a, b] = [u + fillet, v + fillet];
    return Math.hypot(Math.max(a, 0), Math.max(b, 0)) + Math.min(Math.max(a, b), 0) - fillet;
  }
  const cut = (u + v + chamfer) * Math.SQRT1_2;
  const inside = Math.max(u, v, cut);
  if (inside <= 0) return inside;
  if (v <= -chamfer) return u;
  if (u <= -chamfer) return v;
  if (u - v > chamfer) return Math.hypot(u, v + chamfer);
  return v - u > chamfer ? Math.hypot(u + chamfer, v) : cut;
}

/** Signed distance in the field's own frame. */
export function sweptDistance(of: Swept, x: number, y: number, z: number): number {
  if (!of.turned) {
    const [sine, cosine] = [Math.sin(of.angle), Math.cos(of.angle)];
    const q = profileDistance(of.sides, x, y, true);
    const up = z + of.height / 2;
    if (hasRims(of))
      return Math.max(rimDistance(q, -up, of.rims[0], of.rims[1]), rimDistance(q, up - of.height, of.rims[2], of.rims[3]));
    const lean = (of.height * sine) / cosine;
    const wall = q * cosine + up * sine;
    const along = up * cosine - q * sine;
    const inside = Math.max(wall, -up, up - of.height);
    if (inside <= 0) return inside;
    if (up <= 0 && q <= 0) return -up;
    if (up >= of.height && q <= -lean) return up - of.height;
    if (along < 0) return Math.hypot(Math.max(q, 0), up);
    if (along > of.height / cosine) return Math.hypot(Math.max(q + lean, 0), up - of.height);
    return wall;
  }
  const side = profileDistance(of.sides, Math.hypot(x, y), z, false);
  if (of.angle > 6.2831) return side;
  const cap = (c: number, s: number) =>
    Math.hypot(Math.max(profileDistance(of.sides, c * x + s * y, z, true), 0), c * y - s * x);
  const ends = Math.min(cap(1, 0), cap(Math.cos(of.angle), Math.sin(of.angle)));
  const turn = Math.atan2(y, x);
  if ((turn < 0 ? turn + 2 * Math.PI : turn) > of.angle) return ends;
  return side < 0 ? -Math.min(-side, ends) : side;
}

/** A box around it in its own frame. */
export function sweptBox(of: Swept): Box {
  let [low, high] = [
    [Infinity, Infinity],
    [-Infinity, -Infinity],
  ];
  for (const s of of.sides) {
    const around = s.radius ? [-1, 1].map((k) => s.centre.map((v) => v + k * s.radius)) : [];
    for (const p of [s.start, s.end, ...around]) {
      low = low.map((v, i) => Math.min(v, p[i]));
      high = high.map((v, i) => Math.max(v, p[i]));
    }
  }
  if (!of.turned)
    return [
      [low[0], low[1], -of.height / 2],
      [high[0], high[1], of.height / 2],
    ];
  return [
    [-high[0], -high[0], low[1]],
    [high[0], high[0], high[1]],
  ];
}

/** Eight texels a side, in lengths times `scale`: ends; centre, radius and whether it is on the axis; middle, cosine
 * and how many pieces; the pieces. */
export function sideTexels(of: Swept, scale: number): number[] {
  return of.sides.flatMap((s) => {
    const k = (values: number[]) => values.map((v) => v * scale);
    const pieces = [0, 1, 2].flatMap((i) => (s.pieces[i] ? [...k(s.pieces[i].slice(0, 2)), s.pieces[i][2], 0] : [0, 0, 0, 0]));
    const head = [...k([...s.start, ...s.end, ...s.centre, s.radius]), s.onAxis ? 1 : 0];
    return [...head, ...s.middle, s.cosine, s.pieces.length, ...pieces, ...Array(8).fill(0)];
  });
}
