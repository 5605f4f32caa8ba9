/** Learned parts: meshes that the server, or whoever wrote the file, has decoded. They follow their parts' poses. */

import { type Group, type Node, type Part, isGroup, leaves, poses } from "./tree";
import { type Mat3, type Vec3, add, apply, cross, dot, matrix, mul, sub, unit } from "./vectors";

export interface PartMesh {
  /** Places (V, 3) in the part's own frame, and triangles (F, 3). */
  places: Float32Array;
  triangles: Uint32Array;
  /** The half-lengths that it was decoded with. */
  halfLengths: Vec3;
}

export type Meshes = ReadonlyMap<string, PartMesh>;

export const isLearned = (node: Node): boolean => !isGroup(node) && node.field.kind === "neural";

/** Whether a learned part is in a group that does anything but join: its mesh would be shown uncut. */
export function cutsLearned(group: Group): boolean {
  if (group.operation !== "union") return [...leaves(group)].some(isLearned);
  return group.children.some((child) => isGroup(child) && cutsLearned(child));
}

/** What partwright/export/part_meshes.py writes. */
export type GivenMeshes = Record<string, { centre: number[]; half: number[]; places: string; triangles: string; half_lengths: number[] }>;

export function readMeshes(given: GivenMeshes): Meshes {
  return new Map(
    Object.entries(given).map(([name, mesh]) => {
      const steps = new Int16Array(bytes(mesh.places));
      const places = Float32Array.from(steps, (v, i) => mesh.centre[i % 3] + (v / 32767) * mesh.half[i % 3]);
      return [name, { places, triangles: new Uint32Array(bytes(mesh.triangles)), halfLengths: mesh.half_lengths as Vec3 }];
    }),
  );
}

function bytes(base64: string): ArrayBuffer {
  const text = atob(base64);
  return Uint8Array.from(text, (c) => c.charCodeAt(0)).buffer;
}

interface Placed {
  part: number;
  mesh: PartMesh;
  matrix: Mat3;
  translation: Vec3;
  stretch: Vec3;
}

/** The meshes where the parts are now: stretched where half-lengths have changed since they were decoded. */
function* placed(parts: Part[], hidden: ReadonlySet<number>, meshes: Meshes): Generator<Placed> {
  for (const [i, part] of parts.entries()) {
    const mesh = meshes.get(part.name);
    if (!mesh || !isLearned(part) || hidden.has(part.id)) continue;
    const now = part.field.half_lengths as unknown as Vec3;
    const stretch = now.map((v, k) => v / mesh.halfLengths[k]) as Vec3;
    for (const pose of poses(part)) yield { part: i, mesh, matrix: matrix(pose.rotation), translation: pose.translation, stretch };
  }
}

/** Places in own units, the part of each vertex, and triangles. */
export interface Triangles {
  places: Float32Array;
  owners: Uint16Array;
  triangles: Uint32Array;
}

/** All of them as one. */
export function combined(parts: Part[], hidden: ReadonlySet<number>, meshes: Meshes): Triangles {
  const all = [...placed(parts, hidden, meshes)];
  const vertices = all.reduce((sum, one) => sum + one.mesh.places.length / 3, 0);
  const places = new Float32Array(vertices * 3);
  const owners = new Uint16Array(vertices);
  const triangles = new Uint32Array(all.reduce((sum, one) => sum + one.mesh.triangles.length, 0));
  let [vertex, corner] = [0, 0];
  for (const { part, mesh, matrix: m, translation, stretch } of all) {
    const first = vertex;
    for (let i = 0; i < mesh.places.length; i += 3, vertex++) {
      const local: Vec3 = [mesh.places[i] * stretch[0], mesh.places[i + 1] * stretch[1], mesh.places[i + 2] * stretch[2]];
      places.set(add(apply(m, local), translation), 3 * vertex);
      owners[vertex] = part;
    }
    for (const index of mesh.triangles) triangles[corner++] = first + index;
  }
  return { places, owners, triangles };
}

/** Of the vertices (V, 3): the mean of the triangles around, each by its area. */
export function smoothNormals({ places: p, triangles }: Triangles): Float32Array {
  const normals = new Float32Array(p.length);
  for (let i = 0; i < triangles.length; i += 3) {
    const [a, b, c] = [3 * triangles[i], 3 * triangles[i + 1], 3 * triangles[i + 2]];
    const [ux, uy, uz] = [p[b] - p[a], p[b + 1] - p[a + 1], p[b + 2] - p[a + 2]];
    const [vx, vy, vz] = [p[c] - p[a], p[c + 1] - p[a + 1], p[c + 2] - p[a + 2]];
    const n = [uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx];
    for (const at of [a, b, c]) for (let k = 0; k < 3; k++) normals[at + k] += n[k];
  }
  return normals;
}

export interface MeshHit {
  distance: number;
  normal: Vec3;
  part: number;
}

/** The first triangle along a ray beyond `from`, all in own units; only: of one part. */
export function rayHit(mesh: Triangles, eye: Vec3, ray: Vec3, from = 0, only = -1): MeshHit | null {
  const { places: p, triangles, owners } = mesh;
  let best = Infinity;
  let found = -1;
  for (let i = 0; i < triangles.length; i += 3) {
    if (only >= 0 && owners[triangles[i]] !== only) continue;
    const [a, b, c] = [3 * triangles[i], 3 * triangles[i + 1], 3 * triangles[i + 2]];
    // Möller and Trumbore 1997, written out: this runs for every triangle.
    const [ux, uy, uz] = [p[b] - p[a], p[b + 1] - p[a + 1], p[b + 2] - p[a + 2]];
    const [vx, vy, vz] = [p[c] - p[a], p[c + 1] - p[a + 1], p[c + 2] - p[a + 2]];
    const [hx, hy, hz] = [ray[1] * vz - ray[2] * vy, ray[2] * vx - ray[0] * vz, ray[0] * vy - ray[1] * vx];
    const det = ux * hx + uy * hy + uz * hz;
    if (Math.abs(det) < 1e-30) continue;
    const [sx, sy, sz] = [eye[0] - p[a], eye[1] - p[a + 1], eye[2] - p[a + 2]];
    const u = (sx * hx + sy * hy + sz * hz) / det;
    if (u < 0 || u > 1) continue;
    const [qx, qy, qz] = [sy * uz - sz * uy, sz * ux - sx * uz, sx * uy - sy * ux];
    const v = (ray[0] * qx + ray[1] * qy + ray[2] * qz) / det;
    if (v < 0 || u + v > 1) continue;
    const t = (vx * qx + vy * qy + vz * qz) / det;
    if (t > from && t < best) [best, found] = [t, i];
  }
  if (found < 0) return null;
  const corner = (k: number): Vec3 => [p[3 * triangles[found + k]], p[3 * triangles[found + k] + 1], p[3 * triangles[found + k] + 2]];
  let normal = unit(cross(sub(corner(1), corner(0)), sub(corner(2), corner(0))));
  if (dot(normal, ray) > 0) normal = mul(normal, -1);
  return { distance: best, normal, part: owners[triangles[found]] };
}
