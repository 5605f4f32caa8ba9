/** Edits of the tree: each takes the root and gives another. */

import type { FieldData } from "./fields";
import { superfrustum } from "./fields";
import { isPipe, pipeComplaint, withCorners } from "./pipes";
import { isSwept, withLoops } from "./profiles";
import {
  type Group,
  type Node,
  type Operation,
  type Part,
  copied,
  edited,
  find,
  freeName,
  isGroup,
  leaves,
  mirrored,
  newGroup,
  newPart,
  parentOf,
  poses,
  replaced,
} from "./tree";
import { normalised, type Quat, unit, type Vec3 } from "./vectors";

/** The root as the first child of a new one, which is now what knows the unit. */
function wrapped(root: Group, operation: Operation, rest: Node[]): Group {
  const outer = newGroup(operation, [], root.name);
  const inner: Group = { ...root, name: "", unit: null, up: null, metadata: {}, blend: 0 };
  return { ...outer, unit: root.unit, up: root.up, metadata: root.metadata, children: [inner, ...rest] };
}

export function added(root: Group, node: Node): Group {
  if (root.operation === "union") return { ...root, children: [...root.children, node] };
  return wrapped(root, "union", [node]);
}

/** What a new solid of a kind measures, where the assembly's longest side is `size`. */
export function newField(kind: string, size: number): FieldData {
  const [r, h, wall] = [size / 8, size / 4, size / 40];
  const fields: Record<string, FieldData> = {
    superfrustum: { kind, size: [h, h, h], roundness: 0.3, dilation: size / 200, taper: 1, bulge: 0, onion: 0 },
    box: { kind, size: [h, h, h] },
    cylinder: { kind, radius: r, height: h },
    cone: { kind, radius: r, height: h },
    frustum: { kind, bottom_radius: r, top_radius: r / 2, height: h },
    sphere: { kind, radius: r },
    capsule: { kind, radius: r / 2, height: h },
    tube: { kind, radius: r, thickness: wall, height: h },
    torus: { kind, major_radius: r, minor_radius: r / 4 },
    hollow_box: { kind, size: [h, h, h], thickness: wall },
    hollow_frustum: { kind, bottom_radius: r, top_radius: r / 2, thickness: wall, height: h },
  };
  return fields[kind];
}

export const KINDS = ["superfrustum", "box", "cylinder", "cone", "frustum", "sphere", "capsule", "tube", "torus", "hollow_box", "hollow_frustum"];

export function withNew(root: Group, kind: string, size: number, at: Vec3): { root: Group; part: Part } {
  const part = newPart(freeName(root, kind === "superfrustum" ? "part" : kind), newField(kind, size), at);
  return { root: added(root, part), part };
}

export function without(root: Group, ids: Set<number>): Group | null {
  return edited(root, (node) => (ids.has(node.id) ? null : node));
}

/** Each node followed by a copy of its own, changed by `change`. */
export function duplicated(root: Group, nodes: Node[], change: (node: Node) => Node = (n) => n): { root: Group; made: Node[] } {
  const made: Node[] = [];
  let result = root;
  for (const node of nodes) {
    const parent = parentOf(result, node.id);
    if (!parent) continue;
    const copy = change(copied(result, node));
    made.push(copy);
    const at = parent.children.findIndex((c) => c.id === node.id) + 1;
    const children = [...parent.children.slice(0, at), copy, ...parent.children.slice(at)];
    // A copy of what the others are taken away from is no cut: both are what is cut.
    if (parent.operation === "difference" && at === 1)
      children.splice(0, 2, newGroup("union", [node, copy]));
    result = replaced(result, new Map([[parent.id, { ...parent, children }]]));
  }
  return { root: result, made };
}

export function mirrorCopies(root: Group, nodes: Node[], axis: number, at: number): { root: Group; made: Node[] } {
  return duplicated(root, nodes, (node) => mirrored(node, axis, at));
}

/** How a node takes part: added to, or taken away from, or cutting down what comes before it. */
export function roleOf(root: Group, node: Node): Operation {
  const parent = parentOf(root, node.id);
  if (!parent) return "union";
  return parent.operation === "difference" && parent.children[0].id === node.id ? "union" : parent.operation;
}

/** The nodes taken away from all the rest, or added to it again. */
export function withRole(root: Group, nodes: Node[], role: Operation): Group | null {
  const ids = new Set(nodes.map((node) => node.id));
  const rest = without(root, ids);
  if (!rest) return null;
  const inside = nodes.map((node) => find(root, node.id)!);
  if (role === "union") {
    // Into what it was taken away from, where there is one, so that it is as before.
    return added(simplified(rest), unnested(inside));
  }
  const base = simplified(rest);
  if (base.operation === role) return { ...base, children: [...base.children, ...inside] };
  return wrapped(base, role, inside);
}

const unnested = (given: Node[]): Node => (given.length === 1 ? given[0] : newGroup("union", given));

/** Without groups of one child: what was wrapped is unwrapped again. */
export function simplified(root: Group): Group {
  const walk = (node: Node): Node => {
    if (!isGroup(node)) return node;
    const children = node.children.map(walk);
    if (children.length === 1 && !node.name && isGroup(children[0]) && node.id !== root.id)
      return { ...children[0], blend: node.blend };
    return children.some((c, i) => c !== node.children[i]) ? { ...node, children } : node;
  };
  let result = walk(root) as Group;
  if (result.children.length === 1) result = { ...result, operation: "union" };
  const only = result.children[0];
  if (result.children.length === 1 && isGroup(only))
    return { ...only, name: result.name, unit: result.unit, up: result.up, metadata: result.metadata };
  return result;
}

/** A cylinder that is taken away: a hole of this radius and depth, straight in at a place with its outward normal. */
export function drilled(root: Group, at: Vec3, normal: Vec3, radius: number, depth: number): { root: Group; part: Part } | null {
  const axis = unit(normal);
  // Turned from z to the normal.
  const rotation = axis[2] < -1 + 1e-9 ? ([0, 1, 0, 0] as Quat) : normalised([1 + axis[2], -axis[1], axis[0], 0]);
  const height = 2 * depth;
  const part = newPart(freeName(root, "hole"), { kind: "cylinder", radius, height }, at, rotation);
  const whole = withRole(added(root, part), [part], "difference");
  return whole && { root: whole, part };
}

/** The nodes in a group of their own, where the first of them was. */
export function grouped(root: Group, nodes: Node[], operation: Operation): { root: Group; group: Group } | null {
  const first = nodes[0];
  const group = newGroup(operation, nodes);
  const ids = new Set(nodes.slice(1).map((node) => node.id));
  const swapped = replaced(root, new Map([[first.id, { ...group, children: [first], blend: first.blend }]]));
  const rest = ids.size ? without(swapped, ids) : swapped;
  if (!rest) return null;
  const whole = { ...group, blend: first.blend, children: nodes };
  return { root: replaced(rest, new Map([[group.id, whole]])), group: whole };
}

/** A named solid as the SuperFrustum that it is, so that it can be bent, hollowed and rounded. */
export function asSuperfrustum(part: Part): Part {
  const row = superfrustum(part.field);
  if (!row) return part;
  const [sx, sy, sz, roundness, dilation, taper, bulge, onion] = row;
  return { ...part, field: { kind: "superfrustum", size: [sx, sy, sz], roundness, dilation, taper, bulge, onion } };
}

/** Longer or shorter along one of its own axes; kinds that are round change their radii for x and y. */
export function stretched(field: FieldData, axis: number, factor: number): FieldData {
  if (Array.isArray(field.size)) {
    const size = (field.size as number[]).map((v, i) => (i === axis ? Math.max(v * factor, 1e-9) : v));
    return { ...field, size };
  }
  if (field.kind === "neural")
    return { ...field, half_lengths: (field.half_lengths as number[]).map((v, i) => (i === axis ? v * factor : v)) };
  if (field.kind === "quadric") {
    const c = field.coefficients as number[];
    // xx yy zz x y z 1 xy yz zx: how often each has the axis
    const powers = [
      [2, 0, 0, 1, 0, 0, 0, 1, 0, 1],
      [0, 2, 0, 0, 1, 0, 0, 1, 1, 0],
      [0, 0, 2, 0, 0, 1, 0, 0, 1, 1],
    ][axis];
    return { ...field, coefficients: c.map((v, i) => v / factor ** powers[i]) };
  }
  if (isPipe(field)) {
    const made = withCorners(field, (corner) => corner.map((v, i) => (i === axis ? v! * factor : v!)));
    return pipeComplaint(made) ? field : made; // its bends, which stay, may not fit
  }
  const along = axis === 2 && "height" in field;
  // A profile keeps its arcs round: it grows along both of its axes.
  if (isSwept(field) && !along) return withLoops(field, ([x, y, ...bulge]) => [x * factor, y * factor, ...bulge]);
  const names = along ? ["height"] : ["radius", "bottom_radius", "top_radius", "major_radius", "thickness"];
  const result: FieldData = { ...field };
  for (const name of names) if (typeof result[name] === "number") result[name] = (result[name] as number) * factor;
  return result;
}

/** Each copy of a repeated part a part of its own, where the part was; those after the first have new names. */
export function separated(root: Group, part: Part): { root: Group; made: Part[] } {
  const made: Part[] = [];
  for (const [i, pose] of poses(part).entries()) {
    const alone: Part = { ...part, ...pose, instances: [] };
    made.push(i ? (copied({ ...root, children: [...root.children, ...made] }, alone) as Part) : alone);
  }
  const parent = parentOf(root, part.id)!;
  const at = parent.children.findIndex((child) => child.id === part.id);
  // Beside one another where the parent joins, or takes each of them away; elsewhere as a group that joins them.
  const flat = parent.operation === "union" || (parent.operation === "difference" && at > 0);
  const nodes: Node[] = flat ? made : [{ ...newGroup("union", made), blend: part.blend }];
  const children = [...parent.children.slice(0, at), ...nodes, ...parent.children.slice(at + 1)];
  return { root: replaced(root, new Map([[parent.id, { ...parent, children }]])), made };
}

/** A row of copies, each `step` further on: instances of the part, so that they stay alike. */
export function patterned(part: Part, count: number, step: Vec3): Part {
  const instances = Array.from({ length: count - 1 }, (_, i) => ({
    translation: step.map((v) => v * (i + 1)) as Vec3,
    rotation: [1, 0, 0, 0] as [number, number, number, number],
  }));
  return { ...part, instances };
}

/** Copies around an axis through a point, at equal angles. */
export function patternedAround(part: Part, count: number, axis: number, through: Vec3): Part {
  const instances = Array.from({ length: count - 1 }, (_, i) => {
    const half = (Math.PI * (i + 1)) / count;
    const rotation: [number, number, number, number] = [Math.cos(half), 0, 0, 0];
    rotation[axis + 1] = Math.sin(half);
    const [s, c] = [Math.sin(2 * half), Math.cos(2 * half)];
    const [u, v] = [(axis + 1) % 3, (axis + 2) % 3];
    const turned: Vec3 = [...through];
    turned[u] = c * through[u] - s * through[v];
    turned[v] = s * through[u] + c * through[v];
    return { rotation, translation: through.map((p, k) => p - turned[k]) as Vec3 };
  });
  return { ...part, instances };
}

export const countLeaves = (node: Node): number => [...leaves(node)].length;
