/** Pipes: rods and tubes along a path of straight runs and bends. */

import type { FieldData } from "./fields";
import { add, type Box, cross, dot, EMPTY, joinBoxes, length, mul, sub, unit, type Vec3 } from "./vectors";

/** A run from `at` along `way`, or a bend about `at`, from where `out` points towards `way`. */
export interface Piece {
  at: Vec3;
  way: Vec3;
  /** The run's length, or the bend's radius. */
  size: number;
  /** Of a bend: undefined of a run. */
  out?: Vec3;
  angle: number;
}

export interface Pipe {
  pieces: Piece[];
  radius: number;
  /** Radius of the hollow; 0 of a rod. */
  bore: number;
  /** Middles of both ends, and directions out of them. */
  ends: [Vec3, Vec3][];
  /** How little beyond the ends of pieces feet may lie, in own lengths: the shader has no finer ones. */
  near: number;
}

type Corner = [number, number, number, number?];

export const isPipe = (field: FieldData): boolean => field.kind === "pipe";

const corners = (field: FieldData): Corner[] => field.path as unknown as Corner[];

/** The field with other corners. */
export const withCorners = (field: FieldData, move: (corner: Corner) => number[]): FieldData => ({
  ...field,
  path: corners(field).map(move),
});

const known = new WeakMap<object, Pipe>();
const STRAIGHT = 1e-7; // radians
const SHARPEST = (175 * Math.PI) / 180;
const SAME = 1e-9; // of the path's length
const NEAR = 4e-6; // of its length and place
export const NO_BORE = -1e9;

/** What distances are made of; null for any other kind, and for a path that is none. */
export function pipe(field: FieldData): Pipe | null {
  if (!isPipe(field)) return null;
  let found = known.get(field);
  if (!found) {
    const made = pieces(field);
    if (typeof made === "string") return null;
    const [first, last] = [made[0], made[made.length - 1]];
    const radius = Number(field.radius);
    const thickness = Number(field.thickness ?? 0);
    const reach = Math.max(...corners(field).flatMap((c) => c.slice(0, 3).map((v) => Math.abs(v!))));
    found = {
      pieces: made,
      radius,
      bore: thickness ? radius - thickness : 0,
      ends: [
        [place(first, 0), mul(direction(first, 0), -1)],
        [place(last, 1), direction(last, 1)],
      ],
      near: NEAR * (made.reduce((sum, p) => sum + (p.out ? p.size * p.angle : p.size), 0) + reach),
    };
    known.set(field, found);
  }
  return found;
}

/** Why the package would refuse its path and sizes; null where it takes them, but for one that runs into itself. */
export function pipeComplaint(field: FieldData): string | null {
  const path = field.path;
  const good = (c: unknown) => Array.isArray(c) && (c.length === 3 || c.length === 4) && c.every(Number.isFinite);
  if (!Array.isArray(path) || path.length < 2 || !path.every(good)) return "its path is no list of corners";
  const made = pieces(field);
  if (typeof made === "string") return made;
  const radius = Number(field.radius);
  if (Number(field.thickness ?? 0) >= radius) return "the wall is thinner than the radius: the thickness of a solid rod is 0";
  if (made.some((piece) => piece.out && piece.size <= radius)) return "its bends have to be wider than its radius";
  return null;
}

function pieces(field: FieldData): Piece[] | string {
  const given = corners(field);
  const places = given.map((c) => c.slice(0, 3) as Vec3);
  const steps = places.slice(1).map((p, i) => sub(p, places[i]));
  const lengths = steps.map(length);
  const same = SAME * lengths.reduce((a, b) => a + b, 0);
  if (lengths.some((v) => v <= same)) return "two corners of its path are the same point";
  const ways = steps.map(unit);
  const made: Piece[] = [];
  let [start, left] = [places[0], lengths[0]];
  for (let i = 1; i < places.length - 1; i++) {
    const [before, after] = [ways[i - 1], ways[i]];
    const turn = Math.atan2(length(cross(before, after)), dot(before, after));
    if (turn < STRAIGHT) {
      left += lengths[i];
      continue;
    }
    if (turn > SHARPEST) return "its path turns by more than 175 degrees at a corner";
    const bend = given[i][3] ?? 0;
    const reach = bend * Math.tan(turn / 2);
    if (reach > left + same || reach > lengths[i] + same) return "its bends do not fit between its corners";
    const begin = sub(places[i], mul(before, reach));
    if (left - reach > same) made.push({ at: start, way: before, size: left - reach, angle: 0 });
    const inwards = unit(sub(after, mul(before, dot(before, after))));
    made.push({ at: add(begin, mul(inwards, bend)), way: before, out: mul(inwards, -1), size: bend, angle: turn });
    [start, left] = [add(places[i], mul(after, reach)), lengths[i] - reach];
  }
  if (left > same) made.push({ at: start, way: ways[ways.length - 1], size: left, angle: 0 });
  return made;
}

function place(piece: Piece, share: number): Vec3 {
  if (!piece.out) return add(piece.at, mul(piece.way, share * piece.size));
  const turn = share * piece.angle;
  const spoke = add(mul(piece.out, Math.cos(turn)), mul(piece.way, Math.sin(turn)));
  return add(piece.at, mul(spoke, piece.size));
}

function direction(piece: Piece, share: number): Vec3 {
  if (!piece.out) return piece.way;
  const turn = share * piece.angle;
  return sub(mul(piece.way, Math.cos(turn)), mul(piece.out, Math.sin(turn)));
}

/** Squared distance from a piece where a foot on it is. */
function squared(piece: Piece, p: Vec3, near: number): number {
  const off = sub(p, piece.at);
  const along = dot(off, piece.way);
  const square = dot(off, off);
  if (!piece.out) return along >= -near && along <= piece.size + near ? Math.max(square - along * along, 0) : Infinity;
  const x = dot(off, piece.out);
  const beyond = along * Math.cos(piece.angle) - x * Math.sin(piece.angle);
  if (along < -near || beyond > near) return Infinity;
  return (Math.hypot(x, along) - piece.size) ** 2 + Math.max(square - x * x - along * along, 0);
}

/** Signed distance in the field's own frame. */
export function pipeDistance(of: Pipe, x: number, y: number, z: number): number {
  const p: Vec3 = [x, y, z];
  const across = (reach: number) => Math.max(reach - of.radius, (of.bore || NO_BORE) - reach);
  const wall = across(Math.sqrt(of.pieces.reduce((least, piece) => Math.min(least, squared(piece, p, of.near)), 1e30)));
  const ends = of.ends.map(([middle, out]) => {
    const off = sub(p, middle);
    const above = dot(off, out);
    return Math.hypot(Math.max(across(length(sub(off, mul(out, above)))), 0), above);
  });
  const end = Math.min(...ends);
  return wall < 0 ? Math.max(wall, -end) : Math.min(wall, end);
}

/** A box around it in its own frame. */
export function pipeBox(of: Pipe): Box {
  const boxes = of.pieces.map((piece): Box => {
    // All of a bend lies before where the runs beside it would meet.
    const corner = piece.out ? [add(place(piece, 0), mul(piece.way, piece.size * Math.tan(piece.angle / 2)))] : [];
    return [place(piece, 0), place(piece, 1), ...corner].reduce<Box>((box, p) => joinBoxes(box, [p, p]), EMPTY);
  });
  const [low, high] = boxes.reduce(joinBoxes);
  return [low.map((v) => v - of.radius) as Vec3, high.map((v) => v + of.radius) as Vec3];
}

/** Eight texels a piece, in lengths times `scale`: place and size, direction and whether it is a bend, and of a bend where
 * it begins, with cosine and sine of its angle. The last are both ends. */
export function pipeTexels(of: Pipe, scale: number): number[] {
  const rest = Array(16).fill(0);
  const rows = of.pieces.flatMap((piece) => {
    const turn = [Math.cos(piece.angle), Math.sin(piece.angle), 0, 0];
    const head = [...mul(piece.at, scale), piece.size * scale, ...piece.way, piece.out ? 1 : 0];
    return [...head, ...(piece.out ?? [0, 0, 0]), 0, ...turn, ...rest];
  });
  return [...rows, ...of.ends.flatMap(([middle, out]) => [...mul(middle, scale), 0, ...out, 0]), ...rest];
}
