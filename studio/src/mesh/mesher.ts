/** Asks the worker for meshes. */

import { rgb } from "../model/palette";
import type { Store } from "../model/store";
import type { Surface } from "./contour";
import MeshWorker from "./worker?worker&inline";

let worker: Worker | null = null;
let last = 0;
const waiting = new Map<number, { resolve: (surface: Surface) => void; reject: (error: Error) => void }>();

export function mesh(store: Store, cells: number): Promise<Surface> {
  if (!worker) {
    worker = new MeshWorker();
    worker.onmessage = (event: MessageEvent<{ id: number; surface?: Surface; error?: string }>) => {
      const { id, surface, error } = event.data;
      const asked = waiting.get(id);
      waiting.delete(id);
      if (surface) asked?.resolve(surface);
      else asked?.reject(new Error(error));
    };
  }
  worker.onerror = (event) => {
    for (const asked of waiting.values()) asked.reject(new Error(event.message || "the worker could not be started"));
    waiting.clear();
    worker = null;
  };
  const id = ++last;
  const colours = Uint8Array.from(store.program.parts.flatMap((part) => rgb(store.colourOf(part)).map((v) => Math.round(v * 255))));
  worker.postMessage({ id, program: store.program, cells, colours });
  return new Promise((resolve, reject) => waiting.set(id, { resolve, reject }));
}
