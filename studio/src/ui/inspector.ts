/** The numbers of what is selected. */

import { extent } from "../mesh/extent";
import { asSuperfrustum, KINDS, newField, patterned, patternedAround, roleOf } from "../model/edits";
import { complaint, type FieldData, type Parameter, PARAMETERS } from "../model/fields";
import { isLearned } from "../model/learned";
import { formatLength } from "../model/lengths";
import { fromUnit, partBox } from "../model/program";
import type { Store } from "../model/store";
import { type Group, type Node, type Operation, type Part, edited, find, isGroup, leaves } from "../model/tree";
import { type Vec3, fromEuler, isFinite3, sub, toEuler } from "../model/vectors";
import type { Commands } from "./commands";
import { button, menu, numberField, type NumberField, slider, toast } from "./controls";
import { h } from "./dom";
import { rename } from "./parts";

const AXES = ["X", "Y", "Z"];
const STILL = 300; // ms without a change, after which the whole is measured
const ROUGH = 4; // times fewer digits of what is measured

export class Inspector {
  readonly element = h("div", { class: "inspector" });
  private fields: NumberField[] = [];
  private shown = "";
  private sides = h("dd", {}, "…");
  private measuring: ReturnType<typeof setTimeout> | undefined;
  private measured: Group | null = null;

  /** What can be done to a learned part, where there is somebody who can decode it. */
  learnedActions: (part: Part) => HTMLElement[] = () => [
    h("p", { class: "hint" }, "The other parts follow its changes where the model is: open the assembly by `partwright studio`."),
  ];

  constructor(
    private store: Store,
    private commands: Commands,
  ) {
    store.on(["selection", "document", "view"], () => this.update());
    this.update();
  }

  private update(): void {
    const { store } = this;
    const { selected } = store;
    const [node] = selected;
    const one = selected.length === 1 && !isGroup(node) ? node : null;
    const shape = JSON.stringify([
      selected.map((n) => [n.id, n.name, store.locked.has(n.id), isGroup(n) ? n.operation : 0]),
      one?.field.kind,
      one?.instances.length,
      one && roleOf(store.root, one),
      store.isolating,
      store.root.unit,
      selected.length ? 0 : [...leaves(store.root)].length,
    ]);
    if (shape !== this.shown) {
      this.shown = shape;
      this.fields = [];
      this.element.replaceChildren(...(one ? this.part(one) : selected.length ? this.several(selected) : this.whole()));
    }
    for (const field of this.fields) field.refresh();
    this.measure();
  }

  private whole(): HTMLElement[] {
    const { store } = this;
    if (!store.program.parts.length)
      return [h("h2", {}, store.root.name || "Nothing yet"), h("p", { class: "hint" }, "Fit the shape, or add a part by hand.")];
    const unit = store.root.unit ?? "";
    return [
      h("h2", {}, store.root.name || "Assembly"),
      h(
        "dl",
        {},
        h("dt", {}, "Parts"),
        h("dd", {}, String([...leaves(store.root)].length)),
        h("dt", {}, "Size"),
        this.sides,
        h("dt", {}, "Unit"),
        h("dd", {}, unit || "unknown"),
      ),
      h("p", { class: "hint" }, "Click a part to change it; Shift-click for more. Drag to look around, right-drag to move the view, wheel to zoom."),
    ];
  }

  /** Measured once all is still, as that takes a moment. */
  private measure(): void {
    const { root, selected, program, size } = this.store;
    if (selected.length || !program.parts.length || this.measured === root) return;
    this.measured = root;
    this.sides.textContent = "…";
    clearTimeout(this.measuring);
    this.measuring = setTimeout(async () => {
      const say = (text: string) => {
        if (this.measured === root) this.sides.textContent = text;
      };
      try {
        const sides = await extent(this.store);
        const about = sides.every(({ exact }) => exact) ? "" : "≈ ";
        const lengths = sides.map(({ length, exact }) => formatLength(length, exact ? size : ROUGH * size));
        say(sides.length ? `${about}${lengths.join(" × ")} ${root.unit ?? ""}` : "nothing is there");
      } catch (error) {
        say(`not measured: ${error}`);
      }
    }, STILL);
  }

  private several(nodes: Node[]): HTMLElement[] {
    const parts = nodes.flatMap((node) => [...leaves(node)]);
    const title = nodes.length === 1 ? nodes[0].name || "Group" : `${parts.length} parts`;
    return [
      h("h2", {}, title),
      this.actions(nodes),
      this.section("Joint", ...this.joint(nodes)),
      nodes.length > 1
        ? this.section("Group", h("div", { class: "buttons" }, ...(["union", "difference", "intersection"] as Operation[]).map((operation) => button({ label: { union: "Together", difference: "First minus rest", intersection: "What they share" }[operation], run: () => this.commands.group(operation) }, true))))
        : h("span"),
    ];
  }

  private part(part: Part): HTMLElement[] {
    const { store } = this;
    const name = h("input", { type: "text", class: "title", value: part.name, maxlength: 200, "aria-label": "Name", spellcheck: "false" });
    name.addEventListener("change", () => {
      const now = this.now(part);
      rename(store, now, name.value);
      name.value = this.now(part).name;
    });
    name.addEventListener("keydown", (event) => event.key === "Enter" && name.blur());
    const locked = store.locked.has(part.id);
    const body = h("fieldset", { disabled: locked }, ...this.shape(part), this.place(part), this.section("Joint", ...this.joint([part])), this.copies(part));
    return [name, this.actions([part]), locked ? h("p", { class: "hint" }, "Locked: unlock it to change its numbers.") : h("span"), body];
  }

  private now(part: Part): Part {
    return find(this.store.root, part.id) as Part;
  }

  private section(title: string, ...content: HTMLElement[]): HTMLElement {
    return h("section", {}, h("h3", {}, title), ...content);
  }

  private actions(nodes: Node[]): HTMLElement {
    const { commands, store } = this;
    const cut = nodes.every((node) => roleOf(store.root, node) === "difference");
    return h(
      "div",
      { class: "actions" },
      button({ icon: "copy", label: "Duplicate", key: "Shift D", run: () => commands.run("duplicate") }),
      menu("Mirror a copy", "mirror", () => AXES.map((axis, i) => ({ label: `Mirror across ${axis}`, run: () => commands.mirror(i) })), false),
      button({ icon: "subtract", label: cut ? "Add again" : "Take away from the rest", key: "-", run: () => commands.run("subtract") }),
      button({ icon: "isolate", label: store.isolating ? "Show all again" : "Isolate", key: "I", run: () => commands.run("isolate") }),
      button({ icon: "frame", label: "Look at it", key: "F", run: () => commands.run("frame") }),
      button({ icon: "remove", label: "Delete", key: "Del", run: () => commands.run("delete") }),
    );
  }

  private field(part: Part, label: string, change: (part: Part, value: number) => Part) {
    const { store } = this;
    const make = (value: number): Part | null => {
      const changed = change(this.now(part), value);
      const wrong = complaint(changed.field);
      if (wrong) toast(`${label}: ${wrong}.`, undefined, true);
      return wrong ? null : changed;
    };
    const set = (value: number) => {
      const changed = make(value);
      return changed && edited(store.root, (node) => (node.id === part.id ? changed : node));
    };
    return {
      preview: (value: number) => {
        const root = set(value);
        if (root) store.preview(root);
      },
      commit: (value: number) => {
        const root = set(value);
        if (root) store.commit(root, `${label} of ${part.name}`);
        else store.cancel();
      },
    };
  }

  private shape(part: Part): HTMLElement[] {
    const parameters = PARAMETERS[part.field.kind];
    if (!parameters)
      return [this.section("Shape", h("p", { class: "hint" }, "A quadric: a face without end of its own. Move, turn and scale it; S with X, Y or Z stretches it."))];
    const rows = parameters.flatMap((parameter) => this.parameter(part, parameter));
    if (isLearned(part)) return [this.section("Learned part", ...rows, ...this.learnedActions(part))];
    const kind = h("select", { "aria-label": "Kind" }, ...[...new Set([...KINDS, part.field.kind])].map((k) => h("option", { value: k, selected: k === part.field.kind }, k.replace("_", " "))));
    kind.addEventListener("change", () => this.become(part, kind.value));
    return [h("section", {}, h("h3", {}, "Shape", kind), ...rows)];
  }

  private become(part: Part, kind: string): void {
    this.store.change((node) => {
      const own = node as Part;
      if (kind === "superfrustum") return asSuperfrustum(own);
      const box = partBox({ ...own, instances: [], rotation: [1, 0, 0, 0] });
      const size = Math.max(...sub(box[1], box[0]));
      return { ...own, field: isFinite3(box) ? fitted(kind, sub(box[1], box[0])) : newField(kind, size * 4) };
    }, `${part.name} becomes a ${kind.replace("_", " ")}`, [part]);
  }

  private parameter(part: Part, parameter: Parameter): HTMLElement[] {
    const { store } = this;
    const unit = store.root.unit ?? "";
    const add = (label: string, get: (field: FieldData) => number, set: (field: FieldData, value: number) => FieldData) => {
      const change = this.field(part, label, (own, value) => ({ ...own, field: set(own.field, value) }));
      const length = parameter.sort !== "fraction";
      const field = slider({
        label,
        title: `${label}: ${parameter.help}`,
        get: () => get(this.now(part).field),
        ...change,
        low: parameter.low,
        high: parameter.high,
        ...(length ? { size: store.size, unit } : { digits: 3 }),
      });
      this.fields.push(field);
      return field.element;
    };
    if (parameter.sort === "extents")
      return AXES.map((axis, i) =>
        add(
          `${parameter.label} ${axis.toLowerCase()}`,
          (field) => (field[parameter.name] as number[])[i],
          (field, value) => ({ ...field, [parameter.name]: (field[parameter.name] as number[]).map((v, k) => (k === i ? value : v)) }),
        ),
      );
    const otherwise = parameter.name === "taper" ? 1 : 0;
    return [
      add(
        parameter.label,
        (field) => (typeof field[parameter.name] === "number" ? (field[parameter.name] as number) : otherwise),
        (field, value) => ({ ...field, [parameter.name]: value }),
      ),
    ];
  }

  private place(part: Part): HTMLElement {
    const { store } = this;
    const unit = store.root.unit ?? "";
    const row = (label: string, get: (own: Part) => Vec3, set: (own: Part, value: Vec3) => Part, length: boolean) => {
      const fields = AXES.map((axis, i) => {
        const change = this.field(part, `${label} ${axis}`, (own, value) => set(own, get(own).map((v, k) => (k === i ? value : v)) as Vec3));
        const field = numberField({
          label: axis,
          title: `${label} ${axis}: drag to change`,
          get: () => get(this.now(part))[i],
          ...change,
          ...(length ? { size: store.size } : { digits: 1 }),
        });
        this.fields.push(field);
        return field.element;
      });
      return h("div", { class: "triple" }, h("span", {}, label, " ", h("small", {}, length ? unit : "°")), ...fields);
    };
    return this.section(
      "Place",
      row("Position", (own) => own.translation, (own, translation) => ({ ...own, translation }), true),
      row("Turn", (own) => toEuler(own.rotation), (own, degrees) => ({ ...own, rotation: fromEuler(degrees) }), false),
    );
  }

  private joint(nodes: Node[]): HTMLElement[] {
    const { store, commands } = this;
    const ids = nodes.map((node) => node.id);
    const set = (value: number) => edited(store.root, (node) => (ids.includes(node.id) ? { ...node, blend: value } : node))!;
    const blend = slider({
      label: "blend",
      title: "blend: width over which it melts into what comes before it; 0 is a sharp edge",
      get: () => find(store.root, ids[0])?.blend ?? 0,
      preview: (value) => store.preview(set(value)),
      commit: (value) => store.commit(set(value), "Blend"),
      low: 0,
      size: store.size,
      unit: store.root.unit ?? "",
    });
    this.fields.push(blend);
    const roles: [Operation, string][] = [
      ["union", "Added"],
      ["difference", "Taken away"],
      ["intersection", "Only where it is"],
    ];
    const now = roleOf(store.root, nodes[0]);
    const choices = roles.map(([role, label]) =>
      h("button", { type: "button", "aria-pressed": String(role === now), onclick: () => role !== now && commands.role(role) }, label),
    );
    return [h("div", { class: "choice", role: "group", "aria-label": "How it takes part" }, ...choices), blend.element];
  }

  private copies(part: Part): HTMLElement {
    const { store } = this;
    const repeat = (make: (own: Part) => Part) => () => store.change((node) => make(node as Part), `Pattern of ${part.name}`, [part]);
    const count = h("input", { type: "number", min: 2, max: 64, value: Math.max(2, part.instances.length + 1), "aria-label": "How many" });
    const step = h("input", { type: "text", inputmode: "decimal", value: formatLength(store.size / 5, store.size), "aria-label": "Distance" });
    const number = () => Math.max(2, Math.min(64, Number(count.value) || 2));
    const choices = () => [
      ...AXES.map((axis, i) => ({
        label: `In a row along ${axis}`,
        run: repeat((own) => patterned(own, number(), [0, 1, 2].map((k) => (k === i ? Number(step.value) || store.size / 5 : 0)) as Vec3)),
      })),
      ...AXES.map((axis, i) => ({
        label: `Around ${axis}, about the middle`,
        run: repeat((own) => patternedAround(own, number(), i, fromUnit(store.frame, [0, 0, 0]))),
      })),
      ...(part.instances.length ? [{ label: "Each a part of its own", run: () => this.commands.separate(this.now(part)) }] : []),
      ...(part.instances.length ? [{ label: "No copies", run: repeat((own) => ({ ...own, instances: [] })) }] : []),
    ];
    return this.section("Pattern", h("div", { class: "pattern" }, h("label", {}, "copies", count), h("label", {}, "apart", step), menu("Repeat", "pattern", choices)));
  }
}

/** A solid of another kind that fills about the same box. */
function fitted(kind: string, extents: Vec3): FieldData {
  const [x, y, z] = extents;
  const [r, wall] = [Math.max(Math.min(x, y) / 2, 1e-6), Math.max(Math.min(x, y) / 10, 1e-7)];
  const fields: Record<string, FieldData> = {
    box: { kind, size: [x, y, z] },
    cylinder: { kind, radius: r, height: z },
    cone: { kind, radius: r, height: z },
    frustum: { kind, bottom_radius: r, top_radius: r / 2, height: z },
    sphere: { kind, radius: Math.max(Math.min(x, y, z) / 2, 1e-6) },
    capsule: { kind, radius: Math.min(r, z / 2.001), height: Math.max(z - 2 * r, z / 1000) },
    tube: { kind, radius: r, thickness: wall, height: z },
    torus: { kind, major_radius: r * 0.75, minor_radius: r * 0.25 },
    hollow_box: { kind, size: [x, y, z], thickness: wall },
    hollow_frustum: { kind, bottom_radius: r, top_radius: r / 2, thickness: wall, height: z },
  };
  return fields[kind];
}
