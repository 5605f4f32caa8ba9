/** Meshes beside the page's own thread. */

import type { Program } from "../model/program";
import { contour, type Looks } from "./contour";

self.onmessage = (event: MessageEvent<{ id: number; program: Program; cells: number; looks: Looks }>) => {
  const { id, program, cells, looks } = event.data;
  try {
    const surface = contour(program, cells, looks);
    const buffers = Object.values(surface).map((array) => (array as Float32Array).buffer);
    (self as unknown as Worker).postMessage({ id, surface }, buffers as Transferable[]);
  } catch (error) {
    (self as unknown as Worker).postMessage({ id, error: String(error) });
  }
};
