/** Distances, angles and thicknesses between points that are clicked on the surface, in the assembly's unit. */

import { formatLength, formatNumber } from "../model/lengths";
import { type Vec3, distance, dot, sub, unit } from "../model/vectors";

export type Measuring = "distance" | "thickness" | "angle";

export interface Measurement {
  kind: Measuring;
  /** In own units. */
  points: Vec3[];
  label: string;
}

export const POINTS: Record<Measuring, number> = { distance: 2, thickness: 1, angle: 3 };

export const HINTS: Record<Measuring, string> = {
  distance: "Click two points of the surface.",
  thickness: "Click a point: the length straight through from there, which is the diameter of what is round.",
  angle: "Click three points; the angle is at the second.",
};

/** points: as many as the kind asks for; of a thickness the point and where it comes out. */
export function measure(kind: Measuring, points: Vec3[], size: number, unitName: string | null): Measurement {
  if (kind === "angle") {
    const [a, b] = [unit(sub(points[0], points[1])), unit(sub(points[2], points[1]))];
    const angle = (Math.acos(Math.max(-1, Math.min(1, dot(a, b)))) * 180) / Math.PI;
    return { kind, points, label: `${formatNumber(angle, 1)}°` };
  }
  const length = formatLength(distance(points[0], points[1]), size);
  return { kind, points, label: `${kind === "thickness" ? "⌀ " : ""}${length}${unitName ? ` ${unitName}` : ""}` };
}
