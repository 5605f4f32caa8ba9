/**
 * Colours and normals that are baked into parts: images in each part's own coordinates, as PNGs in its metadata (see
 * partwright/textures). Octahedral: directions from the middle, in shares of the half extents, folded into a square.
 */

import { crossSection, unbend, unbentAcross, unbentAlong } from "./distance";
import type { Program } from "./program";
import type { Part } from "./tree";

/** Images of one size: `2 * size` by `size` rgba bytes each, rows from the bottom; on the right the inside. */
export interface Maps {
  size: number;
  count: number;
  data: Uint8Array;
}

const LARGEST = 256; // texels a side
const MOST = 256; // what every device can hold in layers

/** Of a part's metadata. */
export type Baked = "texture" | "normals";

const textOf = (part: Part, key: Baked): string | null => {
  const text = part.metadata[key];
  return typeof text === "string" && text.startsWith("data:image/png;base64,") ? text : null;
};

/** How many parts a file without maps leaves bare. */
export const countTextured = (parts: Iterable<Part>): number => [...parts].filter((part) => textOf(part, "texture") !== null).length;

export class PartMaps {
  maps: Maps | null = null;
  private layers = new Map<string, number>();
  private loading = new Map<string, HTMLImageElement>();

  /** changed: told when images have come that were asked for. */
  constructor(private changed: () => void) {}

  /** The layer of each part's image of colours, or of normals; -1 where it has none, or none yet. */
  of(parts: Part[], key: Baked = "texture"): number[] {
    const texts = parts.map((part) => textOf(part, key));
    const missing = new Set(texts.filter((text): text is string => text !== null && !this.layers.has(text) && !this.loading.has(text)));
    if (missing.size) void this.load(missing);
    return texts.map((text) => (text !== null ? (this.layers.get(text) ?? -1) : -1));
  }

  static some(parts: Iterable<Part>): boolean {
    for (const part of parts) if (textOf(part, "texture") || textOf(part, "normals")) return true;
    return false;
  }

  private async load(texts: Set<string>): Promise<void> {
    const images = new Map<string, HTMLImageElement>();
    for (const text of texts) {
      const image = new Image();
      image.src = text;
      images.set(text, image);
      this.loading.set(text, image);
    }
    await Promise.all([...images.values()].map((image) => image.decode().catch(() => null)));
    for (const [text, image] of images) {
      this.loading.delete(text);
      const good = image.naturalWidth === image.naturalHeight || image.naturalWidth === 2 * image.naturalHeight;
      if (!image.naturalWidth || !good || this.layers.size >= MOST) this.layers.set(text, -1);
      else this.add(text, image);
    }
    this.changed();
  }

  private add(text: string, image: HTMLImageElement): void {
    const before = this.maps;
    // All are of the first one's size: those of one baking are.
    const size = before?.size ?? Math.min(LARGEST, image.naturalHeight);
    const count = (before?.count ?? 0) + 1;
    const canvas = document.createElement("canvas");
    [canvas.width, canvas.height] = [2 * size, size];
    const context = canvas.getContext("2d", { willReadFrequently: true })!;
    const sides = image.naturalWidth / image.naturalHeight;
    context.drawImage(image, 0, 0, sides * size, size);
    if (sides === 1) context.drawImage(image, size, 0, size, size);
    const pixels = context.getImageData(0, 0, 2 * size, size).data;
    const bytes = 8 * size;
    const data = new Uint8Array(count * size * bytes);
    if (before) data.set(before.data);
    const at = (count - 1) * size * bytes;
    for (let y = 0; y < size; y++) data.set(pixels.subarray((size - 1 - y) * bytes, (size - y) * bytes), at + y * bytes);
    this.maps = { size, count, data };
    this.layers.set(text, count - 1);
  }
}

/** Colour (bytes) of a leaf's image at a point of the unit frame: as the shader has it. */
export function mapColour(program: Program, i: number, layer: number, maps: Maps, x: number, y: number, z: number): number[] {
  const { poses, rows } = program;
  const [p, r] = [i * 12, i * 12];
  const local = [0, 4, 8].map((k) => poses[p + k] * x + poses[p + k + 1] * y + poses[p + k + 2] * z + poses[p + k + 3]);
  const [sx, sy, sz, roundness, dilation, taper, bulge, onion] = rows.subarray(r, r + 8);
  const [m, h] = [Math.min(sx, sy) / 2, sz / 2 + 1e-12];
  unbend(local[0], local[2], h, bulge);
  const [across, along] = [unbentAcross, unbentAlong];
  const q = crossSection(across, local[1], sx / 2, sy / 2, roundness * m);
  const t = Math.max(0, Math.min(1, (along / h + 1) / 2));
  const hollow = Math.max(taper, 1) * m * onion > dilation;
  const [bottom, top] = [m * (onion - 1), m * (taper * onion - 1)];
  const inner = hollow && q < (m * (taper - 1) * t + bottom + (top - bottom) * t) / 2;
  const half = [sx / 2, sy / 2, h].map((v) => Math.max(v + dilation, 1e-9));
  const n = [across / half[0], local[1] / half[1], along / half[2]];
  const sum = Math.max(Math.abs(n[0]) + Math.abs(n[1]) + Math.abs(n[2]), 1e-9);
  const [a, b] = [n[0] / sum, n[1] / sum];
  const folded = n[2] < 0 ? [(1 - Math.abs(b)) * (a < 0 ? -1 : 1), (1 - Math.abs(a)) * (b < 0 ? -1 : 1)] : [a, b];
  const { size, data } = maps;
  const [u, v] = folded.map((c) => (c / 2 + 0.5) * size - 0.5);
  const [x0, y0] = [Math.floor(u), Math.floor(v)];
  const result = [0, 0, 0];
  for (const [dx, dy] of [
    [0, 0],
    [1, 0],
    [0, 1],
    [1, 1],
  ]) {
    const column = Math.max(0, Math.min(size - 1, x0 + dx)) + (inner ? size : 0);
    const row = Math.max(0, Math.min(size - 1, y0 + dy));
    const at = ((layer * size + row) * 2 * size + column) * 4;
    const weight = Math.abs(1 - dx - (u - x0)) * Math.abs(1 - dy - (v - y0));
    for (let k = 0; k < 3; k++) result[k] += weight * data[at + k];
  }
  return result;
}
