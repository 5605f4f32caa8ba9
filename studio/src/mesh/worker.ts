/** Meshes beside the page's own thread. */

import type { Program } from "../model/program";
import { contour } from "./contour";

self.onmessage = (event: MessageEvent<{ id: number; program: Program; cells: number; colours: Uint8Array }>) => {
  const { id, program, cells, colours } = event.data;
  try {
    const surface = contour(program, cells, colours);
    const buffers = Object.values(surface).map((array) => (array as Float32Array).buffer);
    (self as unknown as Worker).postMessage({ id, surface }, buffers as Transferable[]);
  } catch (error) {
    (self as unknown as Worker).postMessage({ id, error: String(error) });
  }
};
