/** Asks the worker for meshes. */

import { rgb } from "../model/palette";
import type { Program } from "../model/program";
import type { Store } from "../model/store";
import type { Maps } from "../model/maps";
import type { Looks, Surface } from "./contour";
import MeshWorker from "./worker?worker&inline";

let worker: Worker | null = null;
let last = 0;
const waiting = new Map<number, { resolve: (surface: Surface) => void; reject: (error: Error) => void }>();

/** maps: of parts with baked colours; layers: which of them is whose, or -1. */
export interface Baked {
  maps: { maps: Maps | null };
  layers: number[];
}

export function mesh(store: Store, cells: number, baked: Baked): Promise<Surface> {
  const colours = Uint8Array.from(store.program.parts.flatMap((part) => rgb(store.colourOf(part)).map((v) => Math.round(v * 255))));
  const layers = baked.layers; // which also begins to load what is not there yet
  return contoured(store.program, cells, { colours, layers, maps: baked.maps.maps });
}

export function contoured(program: Program, cells: number, looks: Looks): Promise<Surface> {
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
  worker.postMessage({ id, program, cells, looks });
  return new Promise((resolve, reject) => waiting.set(id, { resolve, reject }));
}
