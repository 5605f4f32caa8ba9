/**
 * A program as the shader's table of floats: a fixed number of texels an instruction, then the sides of profiles and the
 * pieces of pipes.
 */

import { NO_BORE, pipeTexels } from "./pipes";
import { sideTexels } from "./profiles";
import { LEAF, PUSH, type Program } from "./program";

/** Images of colours and of normals have one number in the table: the first one's, and this many times the second's. */
const LAYERS = 512;

/** Texels (of four floats) that an instruction has in the shader's table. */
export const TEXELS = 8;

/**
 * The table of the shader: TEXELS texels of four floats an instruction, and after those as many for each side of a
 * profile, and each piece of a pipe and its ends. layers, reliefs: of the parts' images of colours and of normals, or -1.
 */
export function table(program: Program, layers: number[] = [], reliefs: number[] = []): Float32Array {
  const sides: number[] = [];
  const begins = program.swept.map((profile, i) => {
    const begin = program.count + sides.length / (TEXELS * 4);
    const along = program.pipes[i];
    if (profile) sides.push(...sideTexels(profile, program.frame.scale));
    if (along) sides.push(...pipeTexels(along, program.frame.scale));
    return begin;
  });
  const result = new Float32Array(program.count * TEXELS * 4 + sides.length);
  result.set(sides, program.count * TEXELS * 4);
  program.instructions.forEach((instruction, i) => {
    const { action, operation, blend, part } = instruction;
    const at = i * TEXELS * 4;
    const isQuadric = program.quadrics[i];
    // A push knows by what, and how softly, its group is folded in.
    const third = action === PUSH ? program.roles[i] : part;
    const mapped = action === LEAF && !isQuadric;
    const layer = mapped ? (layers[part] ?? -1) + 1 + LAYERS * ((reliefs[part] ?? -1) + 1) : 0;
    const profile = program.swept[i];
    const along = program.pipes[i];
    const kind = along ? 3 : isQuadric * 2 + (profile ? 1 : 0);
    result.set([action * 16 + operation * 4 + kind, blend, third, layer], at);
    result.set(program.balls.subarray(i * 4, i * 4 + 4), at + 4);
    result.set(program.poses.subarray(i * 12, i * 12 + 12), at + 8);
    const row = program.rows.subarray(i * 12, i * 12 + 12);
    if (profile) {
      const whole = profile.turned && profile.angle > 6.2831 ? 1 : 0;
      const turn = [profile.turned ? 1 : 0, whole, profile.angle, Math.sin(profile.angle), Math.cos(profile.angle)];
      const rims = profile.rims.map((v) => v * program.frame.scale);
      result.set([begins[i], profile.sides.length, profile.height * program.frame.scale, ...turn, ...rims], at + 20);
    } else if (along) {
      const lengths = [along.radius, along.bore || NO_BORE, along.near].map((v) => v * program.frame.scale);
      result.set([begins[i], along.pieces.length, ...lengths], at + 20);
    } else if (action === LEAF && !isQuadric) result.set(derived(row), at + 20);
    else result.set(row, at + 20);
  });
  return result;
}

/** What the shader needs of a SuperFrustum, with all that is the same at every point worked out. */
function derived(row: Float64Array): number[] {
  const [sx, sy, sz, roundness, dilation, taper, bulge, onion] = row;
  const m = Math.min(sx, sy) / 2;
  const theta = (bulge * Math.PI) / 2;
  const closed = Math.max(taper, 1) * m * onion <= dilation ? 1 : 0;
  return [
    sx / 2,
    sy / 2,
    sz / 2 + 1e-12,
    roundness * m,
    dilation,
    m * (taper - 1),
    closed ? 1e9 : m * (onion - 1),
    m * (taper * onion - 1),
    theta,
    Math.sin(theta),
    Math.cos(theta),
    0,
  ];
}
