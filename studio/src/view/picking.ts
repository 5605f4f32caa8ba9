/** What a ray meets, in double precision and without asking the graphics card. */

import { leafDistance, programDistance, programNormal } from "../model/distance";
import { LEAF, SUBTRACT, type Program } from "../model/program";
import { type Vec3, add, mul } from "../model/vectors";

export interface Hit {
  point: Vec3;
  normal: Vec3;
  distance: number;
  /** Index into the program's parts. */
  part: number;
}

const FARTHEST = 80;

/** The first surface along a ray of the unit frame, from `from` on. */
export function pick(program: Program, eye: Vec3, ray: Vec3, from = 0): Hit | null {
  let t = from;
  const relax = program.bent.some((b) => b) ? 0.7 : 1;
  for (let i = 0; i < 400 && t < FARTHEST; i++) {
    const p = add(eye, mul(ray, t));
    const d = programDistance(program, ...p);
    if (d < 1e-5 * Math.max(t, 0.1)) {
      return { point: p, normal: programNormal(program, ...p), distance: t, part: ownerAt(program, p) };
    }
    t += d * relax;
  }
  return null;
}

/** The far side of the solid from a point of its surface, straight in: how thick it is there. */
export function through(program: Program, hit: Hit): Hit | null {
  const inwards = mul(hit.normal, -1);
  let t = 1e-3;
  const relax = program.bent.some((b) => b) ? 0.7 : 1;
  for (let i = 0; i < 2000 && t < FARTHEST; i++) {
    const p = add(hit.point, mul(inwards, t));
    const d = programDistance(program, ...p);
    if (d > -1e-6) return t > 2e-3 ? { ...hit, point: p, distance: t } : null;
    t += Math.max(-d * relax, 1e-5);
  }
  return null;
}

/** The part whose own surface is nearest. */
export function ownerAt(program: Program, p: Vec3): number {
  let [best, owner] = [Infinity, 0];
  program.instructions.forEach((instruction, i) => {
    if (instruction.action !== LEAF) return;
    const off = Math.abs(leafDistance(program, i, ...p));
    // Of two surfaces that coincide the one that cuts is what is seen.
    if (off < best - 1e-6 || (off < best + 1e-6 && instruction.operation === SUBTRACT)) [best, owner] = [off, instruction.part];
  });
  return owner;
}
