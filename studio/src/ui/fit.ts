/** The panel of a fit: what is asked for, how it goes, how good it is. */

import { formatLength, formatNumber } from "../model/lengths";
import type { Store } from "../model/store";
import type { Fit, FromServer, Scored, State } from "../server/messages";
import { button } from "./controls";
import { h, icon } from "./dom";

const METHODS: Record<string, string> = {
  superfrusta: "SuperFrusta: rounded, tapered, bent parts",
  solids: "Solids: boxes, cylinders, cones ...",
  capri: "CSG tree of quadrics",
};

export class FitPanel {
  readonly element = h("div", { class: "fit-panel" });
  private method = h("select", { "aria-label": "Method" });
  private quality = h("select", { "aria-label": "Quality" });
  private most = h("input", { type: "number", min: 1, max: 500, placeholder: "any", "aria-label": "Most parts" });
  private start = button({ icon: "fit", label: "Fit", run: () => this.ask("new") }, true);
  private only = button({ label: "Refit selected", run: () => this.ask("only") }, true);
  private rest = button({ label: "Refit all but locked", run: () => this.ask("except") }, true);
  private stop = button({ icon: "stop", label: "Stop, keep the best", run: () => this.onStop() }, true);
  private bar = h("progress", { max: 1, value: 0, "aria-label": "Progress" });
  private told = h("p", { class: "hint", "aria-live": "polite" });
  private scores = h("dl", {});
  private running = false;
  private state: State | null = null;
  onFit: (fit: Fit) => void = () => {};
  onStop: () => void = () => {};

  constructor(private store: Store) {
    for (const quality of ["draft", "normal", "high"]) this.quality.append(h("option", { value: quality, selected: quality === "normal" }, quality));
    this.start.classList.add("primary");
    this.element.append(
      h("h2", {}, "Fit"),
      h("div", { class: "form" }, h("label", {}, "Method", this.method), h("label", {}, "Quality", this.quality), h("label", {}, "Most parts", this.most)),
      h("div", { class: "buttons" }, this.start, this.only, this.rest, this.stop),
      this.bar,
      this.told,
      this.scores,
    );
    store.on(["selection", "document", "view"], () => this.enable());
  }

  show(state: State): void {
    this.state = state;
    if (!this.method.options.length)
      for (const name of state.methods) this.method.append(h("option", { value: name }, METHODS[name] ?? name));
    this.run(state.fitting);
    if (!state.input) this.told.textContent = "No shape to fit to: drop a mesh, a scene or points into the page.";
    else if (!this.running && !this.told.textContent) this.told.textContent = `Input: ${state.input}`;
  }

  private run(on: boolean): void {
    this.running = on;
    this.bar.hidden = this.stop.hidden = !on;
    this.start.hidden = this.only.hidden = this.rest.hidden = on;
    this.enable();
  }

  private enable(): void {
    const there = Boolean(this.state?.input);
    const parts = this.store.program.parts.length > 0;
    this.start.disabled = !there;
    this.only.disabled = !there || !this.store.editable.length;
    this.rest.disabled = !there || !parts;
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
    });
  }

  hear(message: FromServer): void {
    if (message.type === "fitting") {
      this.run(true);
      this.bar.value = message.fraction;
      const iou = message.iou > 0 ? `, IoU ${formatNumber(message.iou)}` : "";
      this.told.textContent = message.parts ? `${message.stage}: ${message.parts} parts${iou}` : `${message.stage} …`;
    } else if (message.type === "fitted") {
      this.run(false);
      const word = message.outcome.replaceAll("_", " ");
      this.told.textContent = `${word[0].toUpperCase()}${word.slice(1)}: ${message.parts} parts, IoU ${formatNumber(message.iou)}`;
    } else if (message.type === "scored") this.score(message);
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
