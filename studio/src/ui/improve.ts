/** The panel of a goal: what is to be less, what is kept, and the curve of its number as it goes. */

import { formatNumber } from "../model/lengths";
import type { Store } from "../model/store";
import type { FromServer, Improve, Improving, State } from "../server/messages";
import { button } from "./controls";
import { h, svg } from "./dom";

/** What people read in the list, and whether it has an axis. */
const GOALS: Record<string, [string, boolean]> = {
  volume: ["volume", false],
  inertia: ["inertia", true],
  frontal_area: ["area as seen", true],
  newtonian_drag: ["Newtonian drag", true],
  centre: ["centre of mass", true],
};
const [WIDE, HIGH] = [216, 64];

export class ImprovePanel {
  readonly element = h("details", { class: "improve", hidden: true });
  private goal = h("select", { "aria-label": "Goal" });
  private axis = h("select", { "aria-label": "Axis" });
  private walls = h("input", { type: "number", min: 0, max: 100, value: 90, "aria-label": "Walls kept, in %" });
  private volume = h("input", { type: "number", min: 0, max: 100, placeholder: "any", "aria-label": "Volume kept, in %" });
  private steps = h("input", { type: "number", min: 1, max: 500, value: 30, "aria-label": "Steps" });
  private start = button({ label: "Improve all but locked", run: () => this.ask() }, true);
  private curve = svg("svg", { viewBox: `0 0 ${WIDE} ${HIGH}`, class: "goal-curve", role: "img" });
  private told = h("p", { class: "hint", "aria-live": "polite" });
  private state: State | null = null;
  private running = false;
  onImprove: (improve: Improve) => void = () => {};

  constructor(private store: Store) {
    for (const axis of ["x", "y", "z", "-x", "-y", "-z"]) this.axis.append(h("option", { value: axis }, axis.toUpperCase()));
    this.goal.addEventListener("change", () => this.enable());
    this.curve.toggleAttribute("hidden", true);
    this.walls.title = "How much of the thinnest walls is kept, at least";
    this.element.append(
      h("summary", {}, "Towards a goal"),
      h(
        "div",
        { class: "form" },
        h("label", {}, "Less", this.goal),
        h("label", {}, "Along", this.axis),
        h("label", {}, "Walls, %", this.walls),
        h("label", {}, "Volume, %", this.volume),
        h("label", {}, "Steps", this.steps),
      ),
      h("div", { class: "buttons" }, this.start),
      this.curve,
      this.told,
    );
    store.on(["selection", "document", "view"], () => this.enable());
  }

  show(state: State): void {
    this.state = state;
    this.element.hidden = !state.goals.length;
    if (!this.goal.options.length) for (const name of state.goals) this.goal.append(h("option", { value: name }, GOALS[name]?.[0] ?? name));
    this.running = state.fitting;
    this.enable();
  }

  private enable(): void {
    const { parts } = this.store.program;
    this.axis.disabled = !GOALS[this.goal.value]?.[1];
    this.start.disabled = this.running || !this.state || parts.every((part) => this.store.locked.has(part.id));
  }

  private ask(): void {
    const { store } = this;
    const number = (input: HTMLInputElement) => Math.max(0, Number(input.value) || 0);
    this.onImprove({
      type: "improve",
      goal: this.goal.value,
      axis: this.axis.value as Improve["axis"],
      locked: store.program.parts.filter((part) => store.locked.has(part.id)).map((part) => part.name),
      steps: Math.max(1, Math.round(number(this.steps))),
      walls: number(this.walls),
      volume: number(this.volume),
    });
  }

  hear(message: FromServer): void {
    if (message.type === "fitting") this.running = true;
    else if (message.type === "fitted" || message.type === "failed") this.running = false;
    else if (message.type === "improving") this.draw(message);
    this.enable();
  }

  /** What was kept as a line, what was tried and given up as rings, over the steps. */
  private draw({ goal, of, tried }: Improving): void {
    const values = tried.map((one) => one.value);
    const [low, high] = [Math.min(...values), Math.max(...values)];
    const x = (number: number) => 4 + ((WIDE - 8) * number) / Math.max(1, of);
    const y = (value: number) => 4 + ((HIGH - 8) * (high - value)) / (high - low || 1);
    const kept = tried.filter((one) => one.kept);
    const line = kept.map((one, i) => `${i ? "L" : "M"}${x(one.number).toFixed(1)} ${y(one.value).toFixed(1)}`).join("");
    const last = kept.at(-1)!;
    this.curve.replaceChildren(
      ...tried.filter((one) => !one.kept).map((one) => svg("circle", { cx: x(one.number), cy: y(one.value), r: 2, class: "given-up" })),
      svg("path", { d: line }),
      svg("circle", { cx: x(last.number), cy: y(last.value), r: 3 }),
    );
    this.curve.toggleAttribute("hidden", false);
    const change = kept[0].value ? ` (${formatNumber((100 * (last.value - kept[0].value)) / Math.abs(kept[0].value), 3)} %)` : "";
    this.told.textContent = `${goal}: ${formatNumber(kept[0].value)} to ${formatNumber(last.value)}${change}, step ${tried.at(-1)!.number} of ${of}`;
    this.curve.setAttribute("aria-label", this.told.textContent);
  }
}
