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

/** The far side of the clicked part alone, walls and holes passed over: the diameter of what is round. */
export function across(program: Program, hit: Hit): Hit | null {
  const own = program.instructions.flatMap(({ action, part }, i) => (action === LEAF && part === hit.part ? [i] : []));
  const cut = own.some((i) => program.instructions[i].operation === SUBTRACT);
  // Of what is taken away the wall is seen from inside.
  const way = mul(hit.normal, cut ? 1 : -1);
  const distance = (p: Vec3) => Math.min(...own.map((i) => leafDistance(program, i, ...p)));
  const relax = own.some((i) => program.bent[i]) ? 0.7 : 1;
  let t = 4;
  for (let i = 0; i < 400 && t > 2e-3; i++) {
    const p = add(hit.point, mul(way, t));
    const d = distance(p);
    if (d < 1e-6) return { ...hit, point: p, distance: t };
    t -= d * relax;
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
