/** The assembly as the page holds it: the file's own tree, each node with an id that edits keep. Immutable. */

import type { FieldData, Value } from "./fields";
import { complaint, PARAMETERS, scaledField } from "./fields";
import { isPipe, withCorners } from "./pipes";
import { withLoops } from "./profiles";
import { type Quat, type Vec3, add, mul, normalised, NO_ROTATION, product, rotate } from "./vectors";

export type Operation = "union" | "intersection" | "difference";
export const OPERATIONS: Operation[] = ["union", "intersection", "difference"];

export interface Move {
  translation: Vec3;
  rotation: Quat;
}

interface Common {
  readonly id: number;
  readonly name: string;
  readonly blend: number;
  readonly metadata: Record<string, string | number>;
}

export interface Part extends Common {
  readonly field: FieldData;
  readonly translation: Vec3;
  readonly rotation: Quat;
  readonly instances: Move[];
}

export interface Group extends Common {
  readonly operation: Operation;
  readonly children: Node[];
  readonly unit: string | null;
  readonly up: string | null;
}

export type Node = Part | Group;
export const isGroup = (node: Node): node is Group => "children" in node;

let lastId = 0;
const newId = () => ++lastId;

type Json = { [name: string]: Value };

export class AssemblyError extends Error {}

/** Images that stand in many texts, by the names that stand there in their place. */
export type Images = ReadonlyMap<string, string>;

/**
 * The text of an assembly file as a tree; throws an AssemblyError that says what is wrong with it. known: images that
 * the text only names; trees share them.
 */
export function readAssembly(text: string, known: Images = new Map()): Group {
  let data: Json;
  try {
    data = JSON.parse(text) as Json;
  } catch {
    throw new AssemblyError("This is not complete JSON. Was the file cut short?");
  }
  if (!data || data.format !== "partwright-assembly")
    throw new AssemblyError("This is not an assembly file: it does not say \"format\": \"partwright-assembly\".");
  if (data.version !== 1)
    throw new AssemblyError(`This file has version ${String(data.version)}; this page reads version 1.`);
  return readGroup(data, "assembly", 1, known);
}

function readNode(data: Value, place: string, depth: number, known: Images): Node {
  if (!data || typeof data !== "object" || Array.isArray(data)) throw new AssemblyError(`${place}: expected an object`);
  return "children" in data ? readGroup(data, place, depth, known) : readPart(data, place, known);
}

function numbers(value: Value | undefined, count: number, otherwise: number[], place: string): number[] {
  if (value === undefined) return otherwise;
  const good = Array.isArray(value) && value.length === count && value.every((v) => Number.isFinite(v));
  if (!good) throw new AssemblyError(`${place}: expected ${count} numbers`);
  return value as number[];
}

function readMove(data: Json, place: string): Move {
  return {
    translation: numbers(data.translation, 3, [0, 0, 0], `${place}.translation`) as Vec3,
    rotation: unitQuaternion(numbers(data.rotation, 4, NO_ROTATION, `${place}.rotation`) as Quat),
  };
}

/** One that is of unit length already is kept to the bit, as the package does. */
const unitQuaternion = (q: Quat): Quat => (Math.abs(Math.hypot(...q) - 1) < 1e-12 ? q : normalised(q));

function readPart(data: Json, place: string, known: Images): Part {
  const field = data.field as FieldData | undefined;
  if (!field || !(field.kind in PARAMETERS || field.kind === "quadric"))
    throw new AssemblyError(`${place}: this page cannot show a part of kind "${String(field?.kind)}".`);
  const wrong = complaint(field);
  if (wrong) throw new AssemblyError(`${place}: ${wrong}`);
  return {
    id: newId(),
    name: String(data.name ?? ""),
    field,
    ...readMove(data, place),
    blend: numbers(data.blend === undefined ? undefined : [data.blend], 1, [0], `${place}.blend`)[0],
    metadata: readMetadata(data.metadata, known),
    instances: ((data.instances ?? []) as Json[]).map((move, i) => readMove(move, `${place}.instances[${i}]`)),
  };
}

const MARK = "partwright-image:";

function readMetadata(data: Value | undefined, known: Images): Record<string, string | number> {
  const result = (data ?? {}) as Record<string, string | number>;
  const named = Object.entries(result).filter(([, value]) => typeof value === "string" && value.startsWith(MARK));
  const found = named.map(([key, value]) => [key, known.get(String(value).slice(MARK.length)) ?? value]);
  return found.length ? { ...result, ...Object.fromEntries(found) } : result;
}

function readGroup(data: Json, place: string, depth: number, known: Images): Group {
  if (depth > 64) throw new AssemblyError(`${place}: assemblies nest at most 64 deep`);
  if (!OPERATIONS.includes(data.operation as Operation)) throw new AssemblyError(`${place}: unknown operation`);
  if (!Array.isArray(data.children) || !data.children.length) throw new AssemblyError(`${place}: it has no parts`);
  return {
    id: newId(),
    name: String(data.name ?? ""),
    operation: data.operation as Operation,
    blend: typeof data.blend === "number" ? data.blend : 0,
    unit: (data.unit ?? null) as string | null,
    up: (data.up ?? null) as string | null,
    metadata: (data.metadata ?? {}) as Record<string, string | number>,
    children: data.children.flatMap((child, i) => {
      const own = `${place}.children[${i}]`;
      const node = readNode(child, own, depth + 1, known);
      const entries = isGroup(node) ? (((child as Json).instances ?? []) as Json[]) : [];
      return [node, ...entries.map((entry, k) => copyOf(node as Group, entry, `${own}.instances[${k}]`, k + 2))];
    }),
  };
}

/** A copy of a group, as a file's entry has it: mirrored, if it is that, then moved. */
function copyOf(group: Group, entry: Json, place: string, number: number): Group {
  const axis = entry.mirror === undefined ? null : ["x", "y", "z"].indexOf(String(entry.mirror));
  if (axis === -1) throw new AssemblyError(`${place}.mirror: expected x, y or z`);
  const names = (entry.names ?? []) as string[];
  if (names.length && names.length !== [...leaves(group)].length)
    throw new AssemblyError(`${place}.names: expected one for each part`);
  const { translation, rotation } = readMove(entry, place);
  const image = axis === null ? group : mirrored(group, axis, 0);
  const left = [...names];
  const renamed = (node: Node): Node =>
    isGroup(node)
      ? { ...node, id: newId(), children: node.children.map(renamed) }
      : { ...node, id: newId(), name: left.shift() ?? `${node.name}_${String(number).padStart(2, "0")}` };
  return renamed(moved(image, { pivot: [0, 0, 0], rotation, scale: 1, offset: translation })) as Group;
}

/** The assembly file's text: what the package reads. */
export function writeAssembly(root: Group): string {
  return JSON.stringify({ format: "partwright-assembly", version: 1, ...(plain(root, true) as object) }, null, 1) + "\n";
}

function plain(node: Node, top = false): Value {
  const metadata = Object.keys(node.metadata).length ? { metadata: node.metadata } : {};
  if (isGroup(node)) {
    const frame = { ...(top || node.unit ? { unit: node.unit } : {}), ...(top || node.up ? { up: node.up } : {}) };
    const { name, operation, blend } = node;
    return { ...frame, name, operation, blend, ...metadata, children: node.children.map((c) => plain(c)) } as Value;
  }
  const { name, field, translation, rotation, blend } = node;
  const instances = node.instances.length ? { instances: node.instances as unknown as Value } : {};
  return { name, field, translation, rotation, blend, ...instances, ...metadata } as Value;
}

export function* leaves(node: Node): Generator<Part> {
  if (!isGroup(node)) yield node;
  else for (const child of node.children) yield* leaves(child);
}

export function* nodes(node: Node): Generator<Node> {
  yield node;
  if (isGroup(node)) for (const child of node.children) yield* nodes(child);
}

export function find(root: Node, id: number): Node | undefined {
  for (const node of nodes(root)) if (node.id === id) return node;
  return undefined;
}

export function parentOf(root: Node, id: number): Group | undefined {
  for (const node of nodes(root)) if (isGroup(node) && node.children.some((c) => c.id === id)) return node;
  return undefined;
}

/** The tree with each node that `edit` gives another for replaced, or left out where it gives null. */
export function edited(root: Group, edit: (node: Node) => Node | null): Group | null {
  const walk = (node: Node): Node | null => {
    const changed = edit(node);
    if (!changed || changed !== node || !isGroup(node)) return changed;
    const children: Node[] = [];
    let same = true;
    for (const [i, child] of node.children.entries()) {
      const next = walk(child);
      same &&= next === child;
      if (next) children.push(next);
      else if (i === 0 && node.operation === "difference") return null; // nothing is left to take away from
    }
    if (same) return node;
    return children.length ? { ...node, children } : null;
  };
  return walk(root) as Group | null;
}

export function replaced(root: Group, changes: Map<number, Node>): Group {
  return edited(root, (node) => changes.get(node.id) ?? node) ?? root;
}

/** A name that no leaf has: "leg", then "leg_02" ... */
export function freeName(root: Node, wanted: string): string {
  const taken = new Set([...leaves(root)].map((part) => part.name));
  if (!taken.has(wanted)) return wanted;
  const stem = wanted.replace(/_\d+$/, "");
  for (let i = 2; ; i++) {
    const name = `${stem}_${String(i).padStart(2, "0")}`;
    if (!taken.has(name)) return name;
  }
}

/** A copy with ids and names of its own. */
export function copied(root: Group, node: Node): Node {
  const taken: Group = { ...root, children: [...root.children] };
  const walk = (one: Node): Node => {
    if (isGroup(one)) return { ...one, id: newId(), children: one.children.map(walk) };
    const copy = { ...one, id: newId(), name: freeName(taken, one.name) };
    taken.children.push(copy);
    return copy;
  };
  return walk(node);
}

export function newPart(name: string, field: FieldData, translation: Vec3, rotation: Quat = NO_ROTATION): Part {
  return { id: newId(), name, field, translation, rotation, blend: 0, metadata: {}, instances: [] };
}

export function newGroup(operation: Operation, children: Node[], name = ""): Group {
  return { id: newId(), name, operation, blend: 0, unit: null, up: null, metadata: {}, children };
}

/** Turned by `rotation` and scaled about `pivot`, then moved. */
export interface Change {
  pivot: Vec3;
  rotation: Quat;
  scale: number;
  offset: Vec3;
}

export function moved(node: Node, change: Change): Node {
  const place = (p: Vec3): Vec3 => {
    const from: Vec3 = [p[0] - change.pivot[0], p[1] - change.pivot[1], p[2] - change.pivot[2]];
    return add(add(mul(rotate(change.rotation, from), change.scale), change.pivot), change.offset);
  };
  if (isGroup(node))
    return { ...node, blend: node.blend * change.scale, children: node.children.map((c) => moved(c, change)) };
  return {
    ...node,
    field: change.scale === 1 ? node.field : scaledField(node.field, change.scale),
    translation: place(node.translation),
    rotation: normalised(product(change.rotation, node.rotation)),
    blend: node.blend * change.scale,
    instances: node.instances.map((move) => conjugate(move, place, change)),
  };
}

/** What an instance's move becomes where all that it moves is taken through a change: C m C^-1. */
function conjugate(move: Move, place: (p: Vec3) => Vec3, change: Change): Move {
  const back: Quat = [change.rotation[0], -change.rotation[1], -change.rotation[2], -change.rotation[3]];
  const rotation = normalised(product(product(change.rotation, move.rotation), back));
  // Where the point that the change sends to the origin goes.
  const origin = add(
    mul(rotate(back, [-change.pivot[0] - change.offset[0], -change.pivot[1] - change.offset[1], -change.pivot[2] - change.offset[2]]), 1 / change.scale),
    change.pivot,
  );
  return { rotation, translation: place(add(rotate(move.rotation, origin), move.translation)) };
}

/** The poses of a part and of its copies. */
export function poses(part: Part): Move[] {
  return [
    { translation: part.translation, rotation: part.rotation },
    ...part.instances.map((move) => ({
      translation: add(rotate(move.rotation, part.translation), move.translation),
      rotation: normalised(product(move.rotation, part.rotation)),
    })),
  ];
}

/**
 * The node mirrored at the plane through `at` across a world axis. A SuperFrustum is its own mirror image at its
 * xz-plane (its y changes sign), so the mirrored part is the part turned: its local y axis is reversed as well.
 */
export function mirrored(node: Node, axis: number, at: number): Node {
  const flip = (p: Vec3): Vec3 => p.map((v, i) => (i === axis ? 2 * at - v : v)) as Vec3;
  if (isGroup(node)) return { ...node, children: node.children.map((c) => mirrored(c, axis, at)) };
  return {
    ...node,
    translation: flip(node.translation),
    rotation: turnedBack(mirroredRotation(node.rotation, axis), node.field),
    field: mirroredField(node.field),
    instances: node.instances.map((move) => ({
      // M T M with M: p -> flip(p): the rotation's axis is mirrored and its angle reversed.
      rotation: conjugatedByMirror(move.rotation, axis),
      translation: ((): Vec3 => {
        const from: Vec3 = [0, 0, 0];
        from[axis] = 2 * at;
        return flip(add(rotate(move.rotation, from), move.translation));
      })(),
    })),
  };
}

/** At its own xz-plane. */
function mirroredField(field: FieldData): FieldData {
  if (field.kind === "quadric") return mirroredQuadric(field);
  if (isPipe(field)) return withCorners(field, ([x, y, z, ...bend]) => [x, -y, z, ...(bend as number[])]);
  if (field.kind !== "extrusion") return field;
  return withLoops(field, ([x, y, bulge]) => (bulge ? [x, -y, -bulge] : [x, -y]));
}

/** The mirror image of a part of a turn begins where that ends. */
function turnedBack(rotation: Quat, field: FieldData): Quat {
  if (field.kind !== "revolution") return rotation;
  const half = -(Number(field.angle ?? 360) * Math.PI) / 360;
  return product(rotation, [Math.cos(half), 0, 0, Math.sin(half)]);
}

function conjugatedByMirror(q: Quat, axis: number): Quat {
  // The axis of turning is a pseudovector: its component along the mirror's normal stays, the others change sign.
  return [q[0], ...([q[1], q[2], q[3]].map((v, i) => (i === axis ? v : -v)) as Vec3)];
}

function mirroredRotation(q: Quat, axis: number): Quat {
  // M R = (M R M) M, and M along a world axis is a half turn about it times -1; with diag(1, -1, 1) on the right
  // the determinant is 1 again: M R diag(1,-1,1) = (M R M) (M diag(1,-1,1)).
  const half: Quat[] = [
    [0, 0, 0, 1], // diag(-1,1,1) diag(1,-1,1) = diag(-1,-1,1)
    [1, 0, 0, 0],
    [0, 1, 0, 0], // diag(1,1,-1) diag(1,-1,1) = diag(1,-1,-1)
  ];
  return normalised(product(conjugatedByMirror(q, axis), half[axis]));
}

function mirroredQuadric(field: FieldData): FieldData {
  // y -> -y in its own frame: e (of y), h (of xy) and i (of yz) change sign.
  const c = field.coefficients as number[];
  return { ...field, coefficients: c.map((v, i) => (i === 4 || i === 7 || i === 8 ? -v : v)) };
}
