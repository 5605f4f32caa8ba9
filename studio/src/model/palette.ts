/** Colours of parts, as in the package's pictures and exports (partwright/assembly/palette.py). */

import type { Vec3 } from "./vectors";

const FIRST = "4e8fd0 f29e4c 5fb87a db5a6b 9a7fd1 f3c95b 4fbfc4 e08cb8 a3c85a 6b77b8 d97b4a 8fc9f0 b48a6a 3f8f7f c59fe0 b94f7f";
const HAND_PICKED = FIRST.split(" ").map((c) => `#${c}`);

export function paletteColour(i: number): string {
  if (i < HAND_PICKED.length) return HAND_PICKED[i];
  const hue = (0.58 + i * 0.381966) % 1;
  const [l, s] = [[0.52, 0.66, 0.42][i % 3], [0.55, 0.65, 0.45][i % 3]];
  const channel = (n: number) => {
    const k = (n + hue * 12) % 12;
    return Math.round(255 * (l - s * Math.min(l, 1 - l) * Math.max(-1, Math.min(k - 3, 9 - k, 1))));
  };
  return "#" + [channel(0), channel(8), channel(4)].map((c) => c.toString(16).padStart(2, "0")).join("");
}

export function rgb(colour: string): Vec3 {
  const n = parseInt(colour.slice(1), 16);
  return [(n >> 16) / 255, ((n >> 8) & 255) / 255, (n & 255) / 255];
}
