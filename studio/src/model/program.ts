/**
 * An assembly as data: a list of instructions that folds distances, and a row of numbers for each leaf.
 *
 * The shader and `distance.ts` interpret it, so an edit changes numbers and no code. Everything is in the unit
 * frame: the assembly scaled and moved so that its box is centred with a longest side of 1.8.
 */

import { programDistance } from "./distance";
import { fieldBox, quadric, superfrustum } from "./fields";
import { isLearned } from "./learned";
import { type Pipe, pipe } from "./pipes";
import { type Swept, swept } from "./profiles";
import { type Group, type Node, type Part, isGroup, leaves, poses } from "./tree";
import {
  type Box,
  type Vec3,
  add,
  apply,
  applyTransposed,
  corners,
  EMPTY,
  grownBox,
  isEmpty,
  isFinite3,
  joinBoxes,
  length,
  longestSide,
  matrix,
  middle,
  mul,
  sharedBox,
  sub,
} from "./vectors";

export const UNION = 0;
export const INTERSECTION = 1;
export const SUBTRACT = 2;
export const LEAF = 0;
export const PUSH = 1;
export const POP = 2;

export interface Instruction {
  action: number;
  operation: number;
  blend: number;
  /** Index of the part in `Program.parts`; -1 for groups. */
  part: number;
}

export interface Scope {
  /** Of instructions: [first, last] of a child's run, and its corners in the unit frame; null has no bounds. */
  first: number;
  last: number;
  hull: Vec3[] | null;
  /** How far outside of the hull it still matters, by blends. */
  reach: number;
  children: Scope[];
  operation: number;
  /** How the scope is folded into what is around it. */
  role: number;
}

export interface Program {
  instructions: Instruction[];
  count: number;
  parts: Part[];
  /** 12 an instruction: rows of the map from the unit frame to the leaf's own. */
  poses: Float64Array;
  /** 12 an instruction: the field's numbers. */
  rows: Float64Array;
  /** 4 an instruction: centre and radius of a ball around the leaf. */
  balls: Float64Array;
  quadrics: Uint8Array;
  /** Of each instruction: the extrusion or revolution that it is, in own lengths. */
  swept: (Swept | null)[];
  /** Of each instruction: the pipe that it is, in own lengths. */
  pipes: (Pipe | null)[];
  /** Of pushes: the operation by which the group is folded into what is around it. */
  roles: Uint8Array;
  /** How deep groups are nested. */
  depth: number;
  /** 1 where a leaf is bent by so much that its distance may be too large. */
  bent: Uint8Array;
  scope: Scope;
  frame: Frame;
  /** What holds all of it, in the unit frame. */
  box: Box;
}

/** unit = scale * own + offset */
export interface Frame {
  scale: number;
  offset: Vec3;
}

export const toUnit = (frame: Frame, p: Vec3): Vec3 => add(mul(p, frame.scale), frame.offset);
export const fromUnit = (frame: Frame, p: Vec3): Vec3 => mul(sub(p, frame.offset), 1 / frame.scale);

const OPERATION = { union: UNION, intersection: INTERSECTION, difference: SUBTRACT };
const HUGE = 1e6;

/** The box of a part and its copies in own units; infinite where that is not known. */
export function partBox(part: Part): Box {
  const local = fieldBox(part.field);
  if (!isFinite3(local)) return local;
  return poses(part)
    .map((pose): Box => {
      const m = matrix(pose.rotation);
      const at = corners(local).map((p) => add(apply(m, p), pose.translation));
      return at.reduce<Box>((box, p) => joinBoxes(box, [p, p]), EMPTY);
    })
    .reduce(joinBoxes, EMPTY);
}

/** What holds all that is not taken away, in own units; infinite where that is not known. */
export function solidBox(node: Node): Box {
  if (!isGroup(node)) return partBox(node);
  const boxes = (node.operation === "difference" ? node.children.slice(0, 1) : node.children).map(solidBox);
  if (node.operation !== "intersection") return boxes.reduce(joinBoxes, EMPTY);
  const ending = boxes.filter(isFinite3);
  return ending.length ? ending.reduce(sharedBox) : boxes.reduce(joinBoxes, EMPTY);
}

/** A frame in which all that ends is centred, with a longest side of 1.8; extra: what it holds instead. */
export function unitFrame(root: Group, extra: Box | null = null): Frame {
  let box = extra ?? solidBox(root);
  if (!isFinite3(box)) box = ([...leaves(root)].length && roughBox(root)) || EMPTY;
  if (isEmpty(box)) box = [...leaves(root)].map(partBox).filter(isFinite3).reduce(joinBoxes, EMPTY);
  const side = isEmpty(box) ? 0 : longestSide(box);
  if (!(side > 0)) return { scale: 1, offset: [0, 0, 0] };
  const scale = 1.8 / side;
  return { scale, offset: mul(middle(box), -scale) };
}

/** Where an assembly with unbounded leaves lies, found by subdivision from ever larger cubes. */
function roughBox(root: Group): Box | null {
  const places = [...leaves(root)].map((part) => part.translation);
  const centre = mul(places.reduce(add, [0, 0, 0]), 1 / places.length);
  for (let half = 1e-3; half < 1e6; half *= 10) {
    const frame = { scale: 1 / half, offset: mul(centre, -1 / half) };
    const program = compile(root, frame, new Set(), false);
    const box = occupiedBox(program, [
      [-1, -1, -1],
      [1, 1, 1],
    ]);
    if (box && longestSide(box) < 1.99 && longestSide(box) > 0.02)
      return [fromUnit(frame, box[0]), fromUnit(frame, box[1])];
  }
  return null;
}

/** A box around what of the inside lies in `within`, by octants that are surely empty; null where all are. */
function occupiedBox(program: Program, within: Box, only?: number[], depth = 5): Box | null {
  let found: Box = EMPTY;
  const visit = (box: Box, left: number): void => {
    // What lies in the found box already is known.
    if (box[0].every((v, i) => v >= found[0][i]) && box[1].every((v, i) => v <= found[1][i])) return;
    const [c, half] = [middle(box), length(sub(box[1], box[0])) / 2];
    if (programDistance(program, c[0], c[1], c[2], only, true) > half * 1.01) return;
    if (left === 0) {
      found = joinBoxes(found, box);
      return;
    }
    for (const corner of corners(box)) visit(orderedBox(c, corner), left - 1);
  };
  visit(within, depth);
  return isEmpty(found) ? null : found;
}

const tightened = new WeakMap<Program, Box>();

/** `program.box` without what surely is empty at its sides, but for a fiftieth: parts that are bent or cut fill theirs in part. */
export function tightBox(program: Program): Box {
  let box = tightened.get(program);
  if (!box) {
    const found = program.parts.some(isLearned) ? null : occupiedBox(program, program.box, undefined, 6);
    box = found ? sharedBox(program.box, found) : program.box;
    tightened.set(program, box);
  }
  return box;
}

const orderedBox = (a: Vec3, b: Vec3): Box => [
  [Math.min(a[0], b[0]), Math.min(a[1], b[1]), Math.min(a[2], b[2])],
  [Math.max(a[0], b[0]), Math.max(a[1], b[1]), Math.max(a[2], b[2])],
];

/** hidden: ids of parts that are left out. */
export function compile(root: Group, frame: Frame, hidden: Set<number> = new Set(), bounded = true): Program {
  const parts = [...leaves(root)];
  const index = new Map(parts.map((part, i) => [part.id, i]));
  const instructions: Instruction[] = [];
  const poseRows: number[] = [];
  const rows: number[] = [];
  const balls: number[] = [];
  const quadrics: number[] = [];
  const bent: number[] = [];
  const profiles: (Swept | null)[] = [];
  const pipes: (Pipe | null)[] = [];
  let infinite = false;

  const emit = (action: number, operation: number, blend: number, part = -1) => {
    instructions.push({ action, operation, blend: blend * frame.scale, part });
    if (action !== LEAF) {
      poseRows.push(...Array(12).fill(0));
      rows.push(...Array(12).fill(0));
      balls.push(0, 0, 0, HUGE);
      quadrics.push(0);
      bent.push(0);
      profiles.push(null);
      pipes.push(null);
    }
    return instructions.length - 1;
  };

  const leaf = (part: Part, copy: number, operation: number, blend: number): Scope => {
    const pose = poses(part)[copy];
    const at = emit(LEAF, operation, blend, index.get(part.id));
    const m = matrix(pose.rotation);
    const origin = toUnit(frame, pose.translation);
    const back = mul(applyTransposed(m, origin), -1);
    for (let i = 0; i < 3; i++) poseRows.push(m[0][i], m[1][i], m[2][i], back[i]);
    const surface = quadric(part.field);
    if (surface) {
      const { square: s, linear: l, constant } = surface;
      // In the unit frame: f(p / scale), times the scale so that the slope stays of order one.
      const [a, g] = [1 / frame.scale, constant * frame.scale];
      rows.push(s[0][0] * a, s[1][1] * a, s[2][2] * a, s[0][1] * a, s[1][2] * a, s[0][2] * a, ...l, g);
      rows.push(surface.fall * a, surface.rise * a);
      balls.push(0, 0, 0, HUGE);
      infinite = true;
    } else {
      const row = superfrustum(part.field) ?? Array(8).fill(0);
      const k = frame.scale;
      rows.push(row[0] * k, row[1] * k, row[2] * k, row[3], row[4] * k, row[5], row[6], row[7], 0, 0, 0, 0);
      const box = fieldBox(part.field);
      const centre = toUnit(frame, add(apply(m, middle(box)), pose.translation));
      balls.push(...centre, (length(sub(box[1], box[0])) / 2) * k);
    }
    quadrics.push(surface ? 1 : 0);
    profiles.push(swept(part.field));
    pipes.push(pipe(part.field));
    bent.push((superfrustum(part.field)?.[6] ?? 0) > 0.03 ? 1 : 0);
    const hull = surface
      ? null
      : corners(fieldBox(part.field)).map((p) => toUnit(frame, add(apply(m, p), pose.translation)));
    return { first: at, last: at, hull, reach: 0, children: [], operation: LEAF, role: operation };
  };

  const group = (operation: number, role: number, blend: number, fill: () => Scope[]): Scope => {
    const first = emit(PUSH, operation, 0);
    const children = fill();
    const last = emit(POP, role, blend);
    return { first, last, hull: null, reach: 0, children, operation, role };
  };

  const node = (one: Node, role: number, blend: number): Scope[] => {
    if (isGroup(one)) {
      if (![...leaves(one)].some((part) => !hidden.has(part.id) && !isLearned(part))) return [];
      return [group(OPERATION[one.operation], role, blend, () => children(one))];
    }
    if (hidden.has(one.id) || isLearned(one)) return []; // these are meshes
    const copies = 1 + one.instances.length;
    const some = (as: number) => Array.from({ length: copies }, (_, i) => leaf(one, i, as, one.blend));
    if (copies === 1 || role === UNION) return some(role);
    return [group(UNION, role, blend, () => some(UNION))];
  };

  const children = (of: Group): Scope[] => {
    const result: Scope[] = [];
    for (const [i, child] of of.children.entries()) {
      // The first child is what the fold starts from; without it there is nothing to subtract from.
      const role = of.operation === "union" || (i === 0 && of.operation === "difference") ? UNION : OPERATION[of.operation];
      const scopes = node(child, role, child.blend);
      if (i === 0 && of.operation === "difference" && !scopes.length) break;
      result.push(...scopes);
    }
    return result;
  };

  const start = emit(PUSH, OPERATION[root.operation], 0);
  const inner = children(root);
  const end = emit(POP, UNION, 0);
  const scope: Scope = { first: start, last: end, hull: null, reach: 0, children: inner, operation: OPERATION[root.operation], role: UNION };
  const program: Program = {
    instructions,
    count: instructions.length,
    parts,
    poses: Float64Array.from(poseRows),
    rows: Float64Array.from(rows),
    balls: Float64Array.from(balls),
    quadrics: Uint8Array.from(quadrics),
    bent: Uint8Array.from(bent),
    swept: profiles,
    pipes,
    roles: new Uint8Array(instructions.length),
    depth: 0,
    scope,
    frame,
    box: EMPTY,
  };
  setReach(program, scope, 0);
  setRoles(program, scope, 1);
  if (bounded) {
    setHulls(program, scope, infinite);
    setBalls(program, scope);
    program.box = boxOf(scope);
    const learned = parts.filter((part) => isLearned(part) && !hidden.has(part.id)).map(partBox);
    const boxes = learned.map(([low, high]): Box => [toUnit(frame, low), toUnit(frame, high)]);
    if (boxes.length) program.box = [...boxes, ...(scope.children.length ? [program.box] : [])].reduce(joinBoxes);
  }
  return program;
}

/** A blend of width k moves a surface where both are nearer than 5/4 k: how far off each child still matters. */
function setReach(program: Program, scope: Scope, level: number): void {
  scope.reach = level;
  let later = 0;
  for (let i = scope.children.length - 1; i >= 0; i--) {
    const child = scope.children[i];
    const own = i > 0 ? 1.25 * program.instructions[child.last].blend : 0;
    setReach(program, child, level + Math.max(own, later));
    later = Math.max(later, own);
  }
}

function setRoles(program: Program, scope: Scope, depth: number): void {
  if (!scope.children.length) return;
  program.depth = Math.max(program.depth, depth);
  program.roles[scope.first] = scope.role;
  program.instructions[scope.first].blend = program.instructions[scope.last].blend;
  for (const child of scope.children) setRoles(program, child, depth + 1);
}

/** Around groups, so that those that lie far off are passed over at once. */
function setBalls(program: Program, scope: Scope): void {
  if (!scope.children.length) return;
  for (const child of scope.children) setBalls(program, child);
  if (!scope.hull) return;
  const box = boxOf(scope);
  program.balls.set([...middle(box), length(sub(box[1], box[0])) / 2], scope.first * 4);
}

function setHulls(program: Program, scope: Scope, infinite: boolean): void {
  for (const child of scope.children) setHulls(program, child, infinite);
  if (!scope.children.length) return;
  const boxes = scope.children.map((child) => (child.hull ? child.hull.reduce<Box>((b, p) => joinBoxes(b, [p, p]), EMPTY) : null));
  let box: Box | null = null;
  if (scope.operation === UNION) {
    if (boxes.every((b) => b)) box = boxes.reduce<Box>((a, b) => joinBoxes(a, b!), EMPTY);
  } else if (scope.operation === SUBTRACT) {
    box = boxes[0];
  } else {
    const known = boxes.filter((b): b is Box => b !== null);
    if (known.length) box = known.reduce(sharedBox);
  }
  if (infinite && scope.operation === INTERSECTION) {
    // Half-spaces bound one another: subdivision finds where they meet.
    const only = Array.from({ length: scope.last - scope.first + 1 }, (_, i) => scope.first + i);
    only.pop();
    const within: Box = box ?? [
      [-4, -4, -4],
      [4, 4, 4],
    ];
    const found = occupiedBox(program, within, only, 5);
    box = found ?? [middle(within), middle(within)];
  }
  const blends = Math.max(0, ...scope.children.slice(1).map((child) => program.instructions[child.last].blend));
  scope.hull = box && corners(grownBox(isEmpty(box) ? [middle(box), middle(box)] : box, blends / 4));
}

const UNIT: Box = [
  [-0.9, -0.9, -0.9],
  [0.9, 0.9, 0.9],
];

function boxOf(scope: Scope): Box {
  if (!scope.children.length && scope.first !== scope.last) return UNIT; // nothing is there yet
  if (scope.hull) return scope.hull.reduce<Box>((b, p) => joinBoxes(b, [p, p]), EMPTY);
  return [
    [-4, -4, -4],
    [4, 4, 4],
  ];
}
