/** The panel of a fit: what is asked for, how it goes, how good it is. */

import { formatLength, formatNumber } from "../model/lengths";
import type { Store } from "../model/store";
import type { Fit, FromServer, Reshape, Scored, State } from "../server/messages";
import { button } from "./controls";
import { CurveSlider } from "./curve";
import { h, icon } from "./dom";

/** What people read in the list, and more of it where the pointer rests. */
const METHODS: Record<string, [string, string]> = {
  superfrusta: ["Rounded parts", "SuperFrusta: rounded, tapered, bent and hollow parts that blend"],
  solids: ["Named solids", "Boxes, cylinders, cones and other solids, added and taken away"],
  capri: ["Mechanical parts", "CAPRI: a tree of planes, cylinders and other quadrics, with sharp edges"],
};
const OUTCOMES: Record<string, string> = {
  converged: "Done",
  budget_reached: "Done, all rounds used",
  target_reached: "Target reached",
  interrupted: "Stopped, the best is kept",
  left_trained_region: "Stopped at the edge of what the model was trained on",
  failed: "Stopped: the goal cannot be measured farther on",
};

export class FitPanel {
  readonly element = h("div", { class: "fit-panel" });
  private method = h("select", { "aria-label": "Method" });
  private quality = h("select", { "aria-label": "Quality" });
  private most = h("input", { type: "number", min: 1, max: 500, placeholder: "any", "aria-label": "Most parts" });
  private curve = h("input", { type: "checkbox" });
  private slider: CurveSlider;
  private start = button({ icon: "fit", label: "Fit", run: () => this.ask("new") }, true);
  private only = button({ label: "Refit selected", run: () => this.ask("only") }, true);
  private rest = button({ label: "Refit all but locked", run: () => this.ask("except") }, true);
  private split = button({ label: "Split in two", run: () => this.reshape("split") }, true);
  private merge = button({ label: "Merge into one", run: () => this.reshape("merge") }, true);
  private box = button({ label: "A part is missing", run: () => this.onBox() }, true);
  private bake = button({ label: "Bake its colours", run: () => this.onBake() }, true);
  private stop = button({ icon: "stop", label: "Stop, keep the best", run: () => this.onStop() }, true);
  private bar = h("progress", { max: 1, value: 0, "aria-label": "Progress" });
  private told = h("p", { class: "hint", "aria-live": "polite" });
  private scores = h("dl", {});
  private running = false;
  private state: State | null = null;
  onFit: (fit: Fit) => void = () => {};
  onReshape: (reshape: Reshape) => void = () => {};
  onBox: () => void = () => {};
  onBake: () => void = () => {};
  onStop: () => void = () => {};

  constructor(private store: Store) {
    for (const quality of ["draft", "normal", "high"]) this.quality.append(h("option", { value: quality, selected: quality === "normal" }, quality));
    this.start.classList.add("primary");
    this.slider = new CurveSlider(store);
    this.bake.title = "The input's colours as images of the parts, which keep them when they are changed";
    this.box.title = "Draw a box around it, and a part is fitted within";
    this.element.append(
      h("h2", {}, "Fit"),
      h("div", { class: "form" }, h("label", {}, "Method", this.method), h("label", {}, "Quality", this.quality), h("label", {}, "Most parts", this.most), h("label", { class: "check", title: "Takes longer: an assembly of every size, and a slider along them" }, this.curve, "Every size, from few parts to many")),
      h("div", { class: "buttons" }, this.start, this.stop),
      h("div", { class: "buttons pairs" }, this.only, this.rest, this.split, this.merge, this.box, this.bake),
      this.slider.element,
      this.bar,
      this.told,
      this.scores,
    );
    store.on(["selection", "document", "view"], () => this.enable());
    store.on(["history"], () => this.slider.follow());
  }

  show(state: State): void {
    if (this.state && this.state.input !== state.input) this.slider.clear();
    this.state = state;
    if (!this.method.options.length)
      for (const name of state.methods) this.method.append(h("option", { value: name, title: METHODS[name]?.[1] }, METHODS[name]?.[0] ?? name.replace(/^parts:/, "Learned: ")));
    this.run(state.fitting);
    if (!state.input) this.told.textContent = "No shape to fit to: drop a mesh, a scene or points into the page.";
    else if (!this.running && !this.told.textContent) this.told.textContent = `Input: ${state.input}`;
  }

  private run(on: boolean): void {
    this.running = on;
    this.bar.hidden = this.stop.hidden = !on;
    this.bake.hidden = on || !this.state?.coloured;
    for (const one of [this.start, this.only, this.rest, this.split, this.merge, this.box]) one.hidden = on;
    this.slider.enable(!on);
    this.enable();
  }

  private enable(): void {
    const there = Boolean(this.state?.input);
    const parts = this.store.program.parts.length > 0;
    this.start.disabled = !there;
    this.only.disabled = !there || !this.store.editable.length;
    this.rest.disabled = !there || !parts;
    const chosen = this.store.selectedParts;
    const free = chosen.every((part) => !this.store.locked.has(part.id));
    this.split.disabled = !there || chosen.length !== 1 || !free;
    this.split.title = this.split.disabled ? "Select one part" : "Two parts in its place, fitted to what it stands for";
    this.merge.disabled = !there || chosen.length < 2 || !free;
    this.merge.title = this.merge.disabled ? "Select two parts or more" : "One part in their place";
    this.box.disabled = this.bake.disabled = !there || !parts;
    this.only.title = this.only.disabled ? "Select the parts that may change" : "Only the selected parts change";
  }

  private ask(mode: Fit["mode"]): void {
    const { store } = this;
    const names =
      mode === "only"
        ? store.selectedParts.filter((part) => !store.locked.has(part.id)).map((part) => part.name)
        : store.program.parts.filter((part) => store.locked.has(part.id)).map((part) => part.name);
    const most = Math.round(Number(this.most.value));
    this.onFit({
      type: "fit",
      mode,
      names,
      method: this.method.value,
      quality: this.quality.value as Fit["quality"],
      max_parts: most > 0 ? most : null,
      curve: mode === "new" && this.curve.checked,
    });
  }

  private reshape(action: "split" | "merge"): void {
    this.askFor({ action, names: this.store.selectedParts.map((part) => part.name) });
  }

  /** By the method that is chosen. */
  askFor(what: Pick<Reshape, "action" | "names" | "box">): void {
    this.onReshape({ type: "reshape", ...what, method: this.method.value, quality: this.quality.value as Fit["quality"] });
  }

  hear(message: FromServer): void {
    if (message.type === "fitting") {
      this.run(true);
      this.bar.value = message.fraction;
      const iou = message.iou > 0 ? `, IoU ${formatNumber(message.iou)}` : "";
      this.told.textContent = message.parts ? `${message.stage}: ${message.parts} parts${iou}` : `${message.stage} …`;
    } else if (message.type === "fitted") {
      this.run(false);
      const iou = message.iou > 0 ? `, IoU ${formatNumber(message.iou)}` : "";
      this.told.textContent = `${OUTCOMES[message.outcome] ?? message.outcome}: ${message.parts} parts${iou}`;
    } else if (message.type === "failed") {
      if (this.running) this.told.textContent = message.message;
    } else if (message.type === "curve") this.slider.set(message);
    else if (message.type === "scored") this.score(message);
  }

  private score(scored: Scored): void {
    const { store } = this;
    const length = (value: number) => `${formatLength(value, store.size)} ${store.root.unit ?? ""}`;
    const row = (name: string, value: string, title: string) => [h("dt", { title }, name), h("dd", {}, value)];
    this.scores.replaceChildren(
      ...row("IoU", formatNumber(scored.iou, 4), "Of the occupied volumes: 1 is the same"),
      ...row("Off by", `${length(scored.deviation_95)} (95 %)`, "95 % of the surfaces are nearer to each other than this"),
      ...row("At most", length(scored.max_deviation), "The largest distance between the surfaces"),
      ...row("Chamfer", `${formatNumber(scored.chamfer * 1e3, 3)} × 10⁻³`, "Mean squared distance of the surfaces, unit frame"),
      ...row("Overlap", formatNumber(scored.overlap, 3), "Share of the volume that is in two parts or more"),
    );
    this.scores.dataset.revision = String(scored.revision);
  }

  offline(): void {
    this.told.replaceChildren(icon("hidden"), "The server is gone.");
  }
}
