/** How large an assembly is: the box of its surface. That of its parts is larger where they are cut, bent or turned. */

import { isLearned } from "../model/learned";
import { compile, fromUnit, partBox, solidBox } from "../model/program";
import type { Store } from "../model/store";
import { EMPTY, isEmpty, joinBoxes, longestSide } from "../model/vectors";
import { contoured } from "./mesher";

const CELLS = 96;
const ALIKE = 0.1; // cells: a side of the parts' own box is exact where the surface comes so near to it

export interface Side {
  length: number;
  /** Of the parts' own numbers; else measured on a grid, where what is thinner than a cell may be missed. */
  exact: boolean;
}

/** Along x, y and z, in own units, hidden parts counted; of nothing where there is no surface. */
export async function extent(store: Store): Promise<Side[]> {
  const { root, frame } = store;
  const program = compile(root, frame);
  const count = program.parts.length;
  const looks = { colours: new Uint8Array(3 * count), layers: Array(count).fill(-1), maps: null };
  const { places } = await contoured(program, CELLS, looks);
  let box = EMPTY;
  for (let i = 0; i < places.length; i += 3) {
    const place = fromUnit(frame, [places[i], places[i + 1], places[i + 2]]);
    box = joinBoxes(box, [place, place]);
  }
  box = program.parts.filter(isLearned).map(partBox).reduce(joinBoxes, box);
  if (isEmpty(box)) return [];
  const near = (ALIKE * longestSide(program.box)) / CELLS / frame.scale;
  const own = solidBox(root);
  return [0, 1, 2].map((axis) => {
    const exact = [0, 1].every((end) => Math.abs(own[end][axis] - box[end][axis]) < near);
    const [low, high] = exact ? own : box;
    return { length: high[axis] - low[axis], exact };
  });
}
