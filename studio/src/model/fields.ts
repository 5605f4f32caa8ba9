/** The kinds of field: their parameters, and the one formula that most of them are (SuperFrusta, section 3.2). */

import { isPipe, pipe, pipeBox, pipeComplaint, withCorners } from "./pipes";
import { RIMS, isSwept, loops, swept, sweptBox, withLoops } from "./profiles";
import { type Box, type Vec3, dot } from "./vectors";

export type Value = number | string | boolean | null | Value[] | { [name: string]: Value };
export type FieldData = { kind: string; [parameter: string]: Value };

export interface Parameter {
  name: string;
  /** What a slider's label says. */
  label: string;
  /** Lengths are in the assembly's unit and scale with the part; fractions do neither. */
  sort: "length" | "extents" | "fraction";
  low: number;
  /** Undefined for lengths: a slider goes to twice the present value. */
  high?: number;
  help: string;
}

const length = (name: string, help: string, low = 1e-6): Parameter => ({
  name,
  label: name.replaceAll("_", " "),
  sort: "length",
  low,
  help,
});
const extents = (help: string): Parameter => ({ name: "size", label: "size", sort: "extents", low: 0, help });
const fraction = (name: string, high: number, help: string): Parameter => ({
  name,
  label: name,
  sort: "fraction",
  low: 0,
  high,
  help,
});

const RADIUS = length("radius", "of the round cross-section");
const HEIGHT = length("height", "along the part's own z");
const WALL = length("thickness", "of the wall");
const BOTTOM = length("bottom_radius", "at the part's own -z");
const TOP = length("top_radius", "at the part's own +z; at most twice the bottom", 0);

export const PARAMETERS: Record<string, Parameter[]> = {
  superfrustum: [
    extents("full extents before dilation"),
    fraction("roundness", 1, "corner radius of the cross-section, a share of its smaller half extent"),
    { ...length("dilation", "offset of the whole surface outwards", 0) },
    fraction("taper", 2, "width of the top: 1 a prism, 0 a point or ridge, 2 a flare"),
    fraction("bulge", 1, "bends the axis into an arc"),
    fraction("onion", 1, "hollows it along the axis: 0 solid, towards 1 a thin tube"),
  ],
  box: [extents("full extents")],
  cylinder: [RADIUS, HEIGHT],
  cone: [RADIUS, HEIGHT],
  frustum: [BOTTOM, TOP, HEIGHT],
  sphere: [length("radius", "from the centre to the surface")],
  capsule: [RADIUS, length("height", "of the straight middle; the two half spheres come on top")],
  tube: [RADIUS, WALL, HEIGHT],
  torus: [length("major_radius", "of the ring's centre line"), length("minor_radius", "of the tube that is bent")],
  hollow_box: [extents("full extents"), WALL],
  neural: [{ name: "half_lengths", label: "half length", sort: "extents", low: 1e-6, help: "of the part's cuboid; the others adapt" }],
  hollow_frustum: [BOTTOM, TOP, WALL, HEIGHT],
  extrusion: [HEIGHT, ...RIMS.map((name) => length(name, "by which the edges of that end are rounded or cut off", 0))],
  pipe: [RADIUS, length("thickness", "of the wall; 0 where it is solid", 0)],
  revolution: [fraction("angle", 360, "degrees through which the profile is turned")],
};

/** What the formula is told: sx, sy, sz, roundness, dilation, taper, bulge, onion. */
export type Row = [number, number, number, number, number, number, number, number];

const number = (field: FieldData, name: string, otherwise = 0): number =>
  typeof field[name] === "number" ? (field[name] as number) : otherwise;
const triple = (field: FieldData): Vec3 => field.size as unknown as Vec3;
const round = (radius: number, height: number): Vec3 => [2 * radius, 2 * radius, height];
const row = (size: Vec3, roundness = 0, dilation = 0, taper = 1, bulge = 0, onion = 0): Row => [
  ...size,
  roundness,
  dilation,
  taper,
  bulge,
  onion,
];

/** The SuperFrustum with exactly this surface; null where there is none. */
export function superfrustum(field: FieldData): Row | null {
  const get = (name: string) => number(field, name);
  const height = get("height");
  switch (field.kind) {
    case "superfrustum":
      return row(triple(field), get("roundness"), get("dilation"), number(field, "taper", 1), get("bulge"), get("onion"));
    case "box":
      return row(triple(field));
    case "cylinder":
      return row(round(get("radius"), height), 1);
    case "cone":
      return row(round(get("radius"), height), 1, 0, 0);
    case "frustum":
      return row(round(get("bottom_radius"), height), 1, 0, Math.min(2, get("top_radius") / get("bottom_radius")));
    case "sphere":
      return row([0, 0, 0], 0, get("radius"));
    case "capsule":
      return row([0, 0, height], 0, get("radius"));
    case "tube":
      return row(round(get("radius"), height), 1, 0, 1, 0, 1 - get("thickness") / get("radius"));
    case "torus":
      return row(round(get("major_radius"), 0), 1, get("minor_radius"), 1, 0, 1);
    case "hollow_box": {
      const size = triple(field);
      return row(size, 0, 0, 1, 0, 1 - (2 * get("thickness")) / Math.min(size[0], size[1]));
    }
    case "hollow_frustum": {
      const bottom = get("bottom_radius");
      const taper = Math.min(2, get("top_radius") / bottom);
      return row(round(bottom, height), 1, 0, taper, 0, 1 - get("thickness") / bottom);
    }
    default:
      return null;
  }
}

/** Why the package would refuse these parameters; null where it takes them. */
export function complaint(field: FieldData): string | null {
  const get = (name: string) => number(field, name);
  for (const parameter of PARAMETERS[field.kind] ?? []) {
    const given = field[parameter.name];
    const values = parameter.sort === "extents" ? (given as number[]) : [given ?? (parameter.name === "taper" ? 1 : parameter.name === "angle" ? 360 : 0)];
    const high = parameter.high ?? 1e12;
    const wrong = values.some((v) => typeof v !== "number" || !(v >= parameter.low && v <= high));
    if (wrong) return `${parameter.label} has to be from ${parameter.low} to ${high}`;
  }
  if (isPipe(field)) return pipeComplaint(field);
  if (isSwept(field) && !profileIsGood(field)) return "its profile is no outline of corners";
  const [bottomFillet, bottomChamfer, topFillet, topChamfer] = RIMS.map(get);
  if ((bottomFillet && bottomChamfer) || (topFillet && topChamfer)) return "an end has a fillet or a chamfer, not both";
  if (bottomFillet + bottomChamfer + topFillet + topChamfer > 0 && get("taper"))
    return "fillets and chamfers need upright walls: the taper has to be 0";
  if (field.kind === "extrusion" && bottomFillet + bottomChamfer + topFillet + topChamfer > get("height"))
    return "its fillets and chamfers are more than its height";
  if (/frustum$/.test(field.kind) && get("top_radius") > 2 * get("bottom_radius"))
    return "the top radius is at most twice the bottom radius: turn the part over instead";
  if (field.kind === "tube" && get("thickness") >= get("radius"))
    return "the wall is thinner than the radius: a tube without a hole is a cylinder";
  if (field.kind === "torus" && get("minor_radius") >= get("major_radius"))
    return "the minor radius is less than the major one, so that the ring has a hole";
  if (field.kind === "hollow_box" && 2 * get("thickness") >= Math.min(triple(field)[0], triple(field)[1]))
    return "the wall is thinner than half the sides: a hollow box without a hole is a box";
  if (field.kind === "hollow_frustum" && get("thickness") >= get("bottom_radius"))
    return "the wall is thinner than the bottom radius";
  return null;
}

function profileIsGood(field: FieldData): boolean {
  try {
    return loops(field).every((loop) => loop.length > 1 && loop.flat().every(Number.isFinite));
  } catch {
    return false;
  }
}

export interface Quadric {
  square: [Vec3, Vec3, Vec3];
  linear: Vec3;
  constant: number;
  /** Curvatures by which the polynomial can fall, and rise. */
  fall: number;
  rise: number;
}

/** A quadric's coefficients over the largest of the square and the linear ones, in its own frame. */
export function quadric(field: FieldData): Quadric | null {
  if (field.kind !== "quadric") return null;
  const given = field.coefficients as unknown as number[];
  const [a, b, c, d, e, f, g, xy = 0, yz = 0, zx = 0] = given;
  const square: [Vec3, Vec3, Vec3] = [
    [a, xy / 2, zx / 2],
    [xy / 2, b, yz / 2],
    [zx / 2, yz / 2, c],
  ];
  const size = Math.max(...square.flat().map(Math.abs), Math.abs(d), Math.abs(e), Math.abs(f)) || 1;
  for (const line of square) for (let i = 0; i < 3; i++) line[i] /= size;
  const linear: Vec3 = [d / size, e / size, f / size];
  const { values, vectors } = symmetricEigen(square);
  const slope = vectors.map((axis) => Math.abs(dot(axis, linear)));
  const flat = 1e-12;
  const [steepest, widest] = [Math.max(...slope), Math.max(...values.map(Math.abs))];
  const used = values.filter((v, i) => !(Math.abs(v) <= flat * widest && slope[i] <= flat * steepest));
  const kept = used.length ? used : values;
  return { square, linear, constant: g / size, fall: -Math.min(...kept), rise: Math.max(...kept) };
}

/** Eigenvalues and unit eigenvectors of a symmetric matrix, by Jacobi's rotations. */
export function symmetricEigen(given: Vec3[]): { values: number[]; vectors: Vec3[] } {
  const m = given.map((line) => [...line]);
  const v = [
    [1, 0, 0],
    [0, 1, 0],
    [0, 0, 1],
  ];
  for (let sweep = 0; sweep < 30; sweep++) {
    if (Math.abs(m[0][1]) + Math.abs(m[0][2]) + Math.abs(m[1][2]) < 1e-300) break;
    for (const [p, q] of [
      [0, 1],
      [0, 2],
      [1, 2],
    ]) {
      if (m[p][q] === 0) continue;
      const theta = (m[q][q] - m[p][p]) / (2 * m[p][q]);
      const t = (theta < 0 ? -1 : 1) / (Math.abs(theta) + Math.hypot(theta, 1));
      const c = 1 / Math.hypot(t, 1);
      const s = t * c;
      for (const rows of [m, v]) {
        for (let k = 0; k < 3; k++) {
          const [x, y] = [rows[k][p], rows[k][q]];
          rows[k][p] = c * x - s * y;
          rows[k][q] = s * x + c * y;
        }
      }
      for (let k = 0; k < 3; k++) {
        const [x, y] = [m[p][k], m[q][k]];
        m[p][k] = c * x - s * y;
        m[q][k] = s * x + c * y;
      }
    }
  }
  return {
    values: [m[0][0], m[1][1], m[2][2]],
    vectors: [0, 1, 2].map((i) => [v[0][i], v[1][i], v[2][i]] as Vec3),
  };
}

/** Of the part in its own frame; infinite where it does not end or that is not known. */
export function fieldBox(field: FieldData): Box {
  const given = superfrustum(field);
  const profile = swept(field);
  if (profile) return sweptBox(profile);
  const along = pipe(field);
  if (along) return pipeBox(along);
  if (field.kind === "neural") {
    // A learned surface may leave its cuboid by a little.
    const half = (field.half_lengths as number[]).map((v) => 1.1 * v) as Vec3;
    return [half.map((v) => -v) as Vec3, half];
  }
  if (!given) {
    const far = Infinity;
    return [
      [-far, -far, -far],
      [far, far, far],
    ];
  }
  const [sx, sy, sz, , dilation, taper, bulge] = given;
  const flare = (Math.max(0, taper - 1) * Math.min(sx, sy)) / 2;
  const [x, y] = [sx / 2 + flare + dilation, sy / 2 + flare + dilation];
  const angle = (bulge * Math.PI) / 2;
  const [s, k, half] = [Math.sin(angle), Math.cos(angle), sz / 2];
  const top = half + x * s + dilation * k;
  return [
    [-x - half * Math.tan(angle / 2), -y, -top],
    [x * k + dilation * s, y, top],
  ];
}

/** The same solid `factor` times as large. */
export function scaledField(field: FieldData, factor: number): FieldData {
  if (field.kind === "quadric") {
    const c = field.coefficients as number[];
    const scaled = c.map((v, i) => (i < 3 || i > 6 ? v / factor : i === 6 ? v * factor : v));
    return { ...field, coefficients: scaled };
  }
  const result: FieldData = isSwept(field)
    ? withLoops(field, ([x, y, ...bulge]) => [x * factor, y * factor, ...bulge])
    : isPipe(field)
      ? withCorners(field, (corner) => corner.map((v) => v! * factor))
      : { ...field };
  for (const parameter of PARAMETERS[field.kind] ?? []) {
    const value = field[parameter.name];
    if (parameter.sort === "length" && typeof value === "number") result[parameter.name] = value * factor;
    if (parameter.sort === "extents") result[parameter.name] = (value as number[]).map((v) => v * factor);
  }
  return result;
}
