/** Vectors, unit quaternions (w, x, y, z) and 3 x 3 matrices by rows, as plain arrays of doubles. */

export type Vec3 = [number, number, number];
export type Quat = [number, number, number, number];
export type Mat3 = [Vec3, Vec3, Vec3];

export const add = (a: Vec3, b: Vec3): Vec3 => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
export const sub = (a: Vec3, b: Vec3): Vec3 => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
export const mul = (a: Vec3, s: number): Vec3 => [a[0] * s, a[1] * s, a[2] * s];
export const dot = (a: Vec3, b: Vec3): number => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
export const length = (a: Vec3): number => Math.hypot(a[0], a[1], a[2]);
export const distance = (a: Vec3, b: Vec3): number => length(sub(a, b));
export const unit = (a: Vec3): Vec3 => mul(a, 1 / (length(a) || 1));
export const cross = (a: Vec3, b: Vec3): Vec3 => [
  a[1] * b[2] - a[2] * b[1],
  a[2] * b[0] - a[0] * b[2],
  a[0] * b[1] - a[1] * b[0],
];

export const NO_ROTATION: Quat = [1, 0, 0, 0];

/** The rotation `b` followed by `a`. */
export function product(a: Quat, b: Quat): Quat {
  const [aw, ax, ay, az] = a;
  const [bw, bx, by, bz] = b;
  return [
    aw * bw - ax * bx - ay * by - az * bz,
    aw * bx + ax * bw + ay * bz - az * by,
    aw * by - ax * bz + ay * bw + az * bx,
    aw * bz + ax * by - ay * bx + az * bw,
  ];
}

export function normalised(q: Quat): Quat {
  const size = Math.hypot(...q);
  return size > 0 ? [q[0] / size, q[1] / size, q[2] / size, q[3] / size] : NO_ROTATION;
}

export const inverse = (q: Quat): Quat => [q[0], -q[1], -q[2], -q[3]];

export function aboutAxis(axis: Vec3, angle: number): Quat {
  const s = Math.sin(angle / 2);
  return [Math.cos(angle / 2), ...mul(unit(axis), s)];
}

export function matrix(q: Quat): Mat3 {
  const [w, x, y, z] = q;
  return [
    [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
    [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
    [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
  ];
}

export const apply = (m: Mat3, v: Vec3): Vec3 => [dot(m[0], v), dot(m[1], v), dot(m[2], v)];
export const applyTransposed = (m: Mat3, v: Vec3): Vec3 =>
  add(add(mul(m[0], v[0]), mul(m[1], v[1])), mul(m[2], v[2]));
export const rotate = (q: Quat, v: Vec3): Vec3 => apply(matrix(q), v);

/** The unit quaternion of a rotation matrix, by way of its largest component. */
export function quaternion(m: Mat3): Quat {
  const trace = m[0][0] + m[1][1] + m[2][2];
  const twist: Vec3 = [m[2][1] - m[1][2], m[0][2] - m[2][0], m[1][0] - m[0][1]];
  const sizes = [trace, m[0][0], m[1][1], m[2][2]];
  const largest = sizes.indexOf(Math.max(...sizes));
  const q: Quat = [0, 0, 0, 0];
  if (largest === 0) {
    q[0] = 1 + trace;
    [q[1], q[2], q[3]] = twist;
  } else {
    const i = largest - 1;
    q[0] = twist[i];
    for (let j = 0; j < 3; j++) q[1 + j] = m[j][i] + m[i][j];
    q[1 + i] = 1 + 2 * m[i][i] - trace;
  }
  return normalised(q);
}

/** Turns about x, then y, then z, all fixed, in degrees. */
export function toEuler(q: Quat): Vec3 {
  const m = matrix(q);
  const y = Math.asin(Math.max(-1, Math.min(1, -m[2][0])));
  const locked = Math.abs(m[2][0]) > 1 - 1e-9;
  const x = locked ? Math.atan2(-m[1][2], m[1][1]) : Math.atan2(m[2][1], m[2][2]);
  const z = locked ? 0 : Math.atan2(m[1][0], m[0][0]);
  return [x, y, z].map((a) => (a * 180) / Math.PI) as Vec3;
}

export function fromEuler(degrees: Vec3): Quat {
  const [x, y, z] = degrees.map((d) => (d * Math.PI) / 180);
  return product(aboutAxis([0, 0, 1], z), product(aboutAxis([0, 1, 0], y), aboutAxis([1, 0, 0], x)));
}

export type Box = [Vec3, Vec3];
export const EMPTY: Box = [
  [Infinity, Infinity, Infinity],
  [-Infinity, -Infinity, -Infinity],
];
export const isFinite3 = (box: Box): boolean => box.every((corner) => corner.every(Number.isFinite));
export const isEmpty = (box: Box): boolean => box[0].some((low, i) => !(low <= box[1][i]));
export const joinBoxes = (a: Box, b: Box): Box => [
  [Math.min(a[0][0], b[0][0]), Math.min(a[0][1], b[0][1]), Math.min(a[0][2], b[0][2])],
  [Math.max(a[1][0], b[1][0]), Math.max(a[1][1], b[1][1]), Math.max(a[1][2], b[1][2])],
];
export const sharedBox = (a: Box, b: Box): Box => [
  [Math.max(a[0][0], b[0][0]), Math.max(a[0][1], b[0][1]), Math.max(a[0][2], b[0][2])],
  [Math.min(a[1][0], b[1][0]), Math.min(a[1][1], b[1][1]), Math.min(a[1][2], b[1][2])],
];
export const grownBox = (box: Box, by: number): Box => [
  [box[0][0] - by, box[0][1] - by, box[0][2] - by],
  [box[1][0] + by, box[1][1] + by, box[1][2] + by],
];
export const middle = (box: Box): Vec3 => mul(add(box[0], box[1]), 0.5);
export const longestSide = (box: Box): number => Math.max(...sub(box[1], box[0]));
export const corners = (box: Box): Vec3[] =>
  [0, 1, 2, 3, 4, 5, 6, 7].map((i) => [box[i & 1][0], box[(i >> 1) & 1][1], box[(i >> 2) & 1][2]]);
