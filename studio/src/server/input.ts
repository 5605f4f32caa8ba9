/** The shape that is fitted, as triangles for the picture. */

import type { Store } from "../model/store";
import type { Mesh } from "../view/meshes";

export interface Triangles {
  places: Float32Array; // own units
  triangles: Uint32Array;
  /** rgb bytes of the vertices; empty where the input has no colours. */
  colours: Uint8Array;
}

export async function loadInput(url: string): Promise<Triangles> {
  const answer = await fetch(url);
  if (!answer.ok) throw new Error(`the server answers ${answer.status}`);
  const buffer = await answer.arrayBuffer();
  const [vertices, faces, coloured] = new Uint32Array(buffer, 0, 3);
  return {
    places: new Float32Array(buffer, 12, vertices * 3),
    triangles: new Uint32Array(buffer, 12 + vertices * 12, faces * 3),
    colours: new Uint8Array(buffer, 12 + (vertices + faces) * 12, coloured * 3),
  };
}

const GREY = [176, 180, 188];

/** In the unit frame, with flat normals left to the shader, which finds them where there are none. */
export function asMesh(input: Triangles, store: Store): Mesh {
  const { scale, offset } = store.frame;
  const places = Float32Array.from(input.places, (v, i) => v * scale + offset[i % 3]);
  const colours = new Uint8Array((places.length / 3) * 4);
  for (let i = 0; i < colours.length / 4; i++) {
    const own = input.colours.length ? input.colours.subarray(3 * i, 3 * i + 3) : GREY;
    colours.set(own, 4 * i);
  }
  return { places, normals: new Float32Array(places.length), colours, triangles: input.triangles };
}
