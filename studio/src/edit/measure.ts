/** Distances, angles and thicknesses between points that are clicked on the surface, in the assembly's unit. */

import { formatLength, formatNumber } from "../model/lengths";
import { type Vec3, distance, dot, sub, unit } from "../model/vectors";

export type Measuring = "distance" | "diameter" | "thickness" | "angle";

export interface Measurement {
  kind: Measuring;
  /** In own units. */
  points: Vec3[];
  label: string;
}

export const POINTS: Record<Measuring, number> = { distance: 2, diameter: 1, thickness: 1, angle: 3 };

export const HINTS: Record<Measuring, string> = {
  distance: "Click two points of the surface.",
  diameter: "Click a part: straight across it from there, hollow or not; of a hole, across the hole.",
  thickness: "Click a point: the material straight through from there, to where it ends.",
  angle: "Click three points; the angle is at the second.",
};

/** points: as many as the kind asks for; of a diameter or thickness the point and where it comes out. */
export function measure(kind: Measuring, points: Vec3[], size: number, unitName: string | null): Measurement {
  if (kind === "angle") {
    const [a, b] = [unit(sub(points[0], points[1])), unit(sub(points[2], points[1]))];
    const angle = (Math.acos(Math.max(-1, Math.min(1, dot(a, b)))) * 180) / Math.PI;
    return { kind, points, label: `${formatNumber(angle, 1)}°` };
  }
  const length = formatLength(distance(points[0], points[1]), size);
  return { kind, points, label: `${kind === "diameter" ? "⌀ " : ""}${length}${unitName ? ` ${unitName}` : ""}` };
}
