/** A slider along the curve of the last fit: from few parts to many. */

import { formatNumber } from "../model/lengths";
import type { Store } from "../model/store";
import { readAssembly } from "../model/tree";
import type { Curve, Size } from "../server/messages";
import { h } from "./dom";

export class CurveSlider {
  readonly element = h("div", { class: "curve", hidden: true });
  private sizes: Size[] = []; // from few parts to many
  private range = h("input", { type: "range", min: 0, step: 1, "aria-label": "From few parts to many" });
  private told = h("output", {});

  constructor(private store: Store) {
    this.element.append(h("label", {}, h("span", {}, "Fewer"), this.range, h("span", {}, "More")), this.told);
    this.range.addEventListener("input", () => this.show(false));
    this.range.addEventListener("change", () => this.show(true));
  }

  set(curve: Curve): void {
    this.sizes = [...curve.sizes].sort((a, b) => a.parts - b.parts);
    this.range.max = String(this.sizes.length - 1);
    this.element.hidden = this.sizes.length < 2;
    this.follow();
  }

  clear(): void {
    this.sizes = [];
    this.element.hidden = true;
  }

  enable(on: boolean): void {
    this.range.disabled = !on;
  }

  /** Where the handle stands: at the size that the page shows, or the nearest. */
  follow(): void {
    const { sizes } = this;
    if (!sizes.length) return;
    const shown = /^(\d+) of at most/.exec(this.store.undoLabel ?? "");
    const count = shown ? Number(shown[1]) : this.store.program.parts.length;
    const off = sizes.map((size) => Math.abs(size.parts - count));
    this.range.value = String(off.indexOf(Math.min(...off)));
    this.mark();
    // What was edited since is none of them.
    if (!shown) this.told.value = `${sizes[0].parts} to ${sizes.at(-1)!.parts} parts`;
  }

  private mark(): Size {
    const size = this.sizes[Number(this.range.value)];
    this.range.style.setProperty("--share", `${(100 * Number(this.range.value)) / Math.max(1, this.sizes.length - 1)}%`);
    this.told.value = `${size.parts} ${size.parts === 1 ? "part" : "parts"}, IoU ${formatNumber(size.iou)}`;
    return size;
  }

  private show(keep: boolean): void {
    const size = this.mark();
    const root = this.store.named(readAssembly(size.text));
    if (keep) this.store.commit(root, `${size.parts} of at most ${this.sizes.at(-1)!.parts} parts`);
    else this.store.preview(root);
  }
}
