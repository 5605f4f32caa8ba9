/** The page: bars around the picture, panels beside it. */

import { HINTS, type Measuring } from "../edit/measure";
import { KINDS } from "../model/edits";
import { isLearned } from "../model/learned";
import { countTextured, PartMaps } from "../model/maps";
import { rgb } from "../model/palette";
import type { Store } from "../model/store";
import { leaves, readAssembly, writeAssembly } from "../model/tree";
import { Commands } from "./commands";
import { type Button, button, menu, save, tellOfMaps, toast } from "./controls";
import { h, icon, type Icon } from "./dom";
import { Inspector } from "./inspector";
import { PartList } from "./parts";
import { type Tool, Viewport } from "./viewport";

const TOOLS: [Tool, Icon, string, string][] = [
  ["select", "select", "Select", "Q"],
  ["move", "move", "Move", "W"],
  ["rotate", "rotate", "Rotate", "E"],
  ["scale", "scale", "Scale", "T"],
  ["measure", "measure", "Measure", "M"],
];

export class App {
  readonly viewport: Viewport;
  readonly commands: Commands;
  readonly inspector: Inspector;
  readonly status = h("output", { class: "status", "aria-live": "polite" });
  readonly side = h("aside", { class: "panel left", "data-tab": "parts" });
  /** What else the top bar offers to download. */
  moreDownloads: () => (Button | null)[] = () => [];
  /** Where the top bar takes further buttons. */
  readonly actions = h("div", { class: "group" });
  private tabs = h("nav", { class: "tabs", role: "tablist" });
  private main = h("main", { "data-tab": "parts" });
  private measureBar = h("div", { class: "measure-bar float", hidden: true });
  private bar = h("header", { class: "top" });

  constructor(readonly store: Store) {
    this.viewport = new Viewport(store);
    this.commands = new Commands(store, this.viewport);
    this.inspector = new Inspector(store, this.commands);
    this.viewport.onStatus = (text) => (this.status.value = text);
    store.onRefused = (text) => toast(text, undefined, true);
    this.layout();
    this.theme(localStorageGet("partwright-theme"));
    store.on(["document", "history"], () => this.title());
    window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.paint());
    this.viewport.begin();
    this.dropFiles();
  }

  private layout(): void {
    const { store, commands, viewport } = this;
    const undo = button({ icon: "undo", label: "Undo", key: "Ctrl Z", run: () => commands.run("undo") });
    const redo = button({ icon: "redo", label: "Redo", key: "Ctrl Shift Z", run: () => commands.run("redo") });
    const steps = () => {
      undo.disabled = !store.undoLabel;
      redo.disabled = !store.redoLabel;
      undo.title = store.undoLabel ? `Undo: ${store.undoLabel} (Ctrl Z)` : "Nothing to undo";
      redo.title = store.redoLabel ? `Redo: ${store.redoLabel} (Ctrl Shift Z)` : "Nothing to do again";
    };
    store.on(["history"], steps);
    steps();
    const name = h("span", { class: "name" });
    store.on(["document"], () => (name.textContent = store.root.name || "Assembly"));
    name.textContent = store.root.name || "Assembly";
    this.bar.append(
      h("h1", {}, icon("layers"), name),
      h("div", { class: "group" }, undo, redo),
      menu("Add", "add", () => [...KINDS.map((kind) => ({ label: kind.replace("_", " "), run: () => commands.add(kind) })), null, { icon: "subtract" as Icon, label: "Hole, where you click", run: () => commands.hole() }]),
      h("span", { class: "space" }),
      menu("View", "frame", () => this.views()),
      menu("Download", "download", () => this.downloads()),
      this.actions,
      button({ icon: "theme", label: "Light or dark", run: () => this.theme(this.dark ? "light" : "dark") }),
      button({ icon: "help", label: "Help", key: "?", run: () => this.help() }),
    );
    document.addEventListener("keydown", (event) => {
      if (event.key === "?" && !(event.target as HTMLElement).matches("input, textarea, select")) this.help();
    });

    const tools = h("div", { class: "tools float", role: "toolbar", "aria-label": "Tools" });
    const buttons = TOOLS.map(([tool, name, label, key]) => {
      const one = button({ icon: name, label, key, run: () => viewport.setTool(tool) });
      one.dataset.tool = tool;
      return one;
    });
    const snap = button({ icon: "snap", label: "Snap", key: "Shift Tab", run: () => commands.run("snap") });
    commands.onSnap = () => snap.setAttribute("aria-pressed", String(store.snapping));
    commands.onSnap();
    tools.append(...buttons, h("hr"), snap);
    viewport.onTool = () => {
      for (const one of buttons) one.setAttribute("aria-pressed", String(one.dataset.tool === viewport.tool));
      this.measureBar.hidden = viewport.tool !== "measure";
      this.status.value = viewport.tool === "measure" ? HINTS[viewport.measuring] : "";
    };
    viewport.onTool();
    this.fillMeasureBar();

    const list = new PartList(store);
    this.side.append(list.element);
    const right = h("aside", { class: "panel right", "data-tab": "numbers" }, this.inspector.element);
    viewport.element.append(tools, this.measureBar, this.status);

    // On a narrow screen the panels share the place below the picture.
    this.main.append(this.side, viewport.element, right);
    this.addTab("parts", "Parts");
    this.addTab("numbers", "Numbers");
    document.body.append(this.bar, this.main, this.tabs);
  }

  /** On a narrow screen; on a wide one all panels are there. */
  addTab(tab: string, label: string, content?: HTMLElement): void {
    content?.setAttribute("data-part", tab);
    const one = h("button", { type: "button", role: "tab", "aria-selected": String(tab === this.main.dataset.tab) }, label);
    one.addEventListener("click", () => {
      this.main.dataset.tab = tab;
      for (const other of this.tabs.children) other.setAttribute("aria-selected", String(other === one));
    });
    this.tabs.append(one);
  }

  /** The whole assembly in the picture, after another one has come. */
  begin(): void {
    this.viewport.begin();
  }

  private fillMeasureBar(): void {
    const { viewport } = this;
    const kinds: [Measuring, string][] = [
      ["distance", "Distance"],
      ["diameter", "Diameter"],
      ["thickness", "Thickness"],
      ["angle", "Angle"],
    ];
    const buttons = kinds.map(([kind, label]) => {
      const one = h("button", { type: "button" }, label);
      one.addEventListener("click", () => {
        viewport.measuring = kind;
        viewport.setTool("measure");
        mark();
      });
      return one;
    });
    const mark = () => buttons.forEach((one, i) => one.setAttribute("aria-pressed", String(kinds[i][0] === viewport.measuring)));
    mark();
    this.measureBar.append(...buttons, button({ icon: "remove", label: "Clear", run: () => viewport.clearMeasurements() }));
  }

  private views(): (Button | null)[] {
    const { commands } = this;
    return [
      { icon: "frame", label: "All, or what is selected", key: "F", run: () => commands.run("frame") },
      null,
      { label: "From the front", key: "1", run: () => commands.run("front") },
      { label: "From the right", key: "3", run: () => commands.run("side") },
      { label: "From above", key: "7", run: () => commands.run("top") },
      null,
      { icon: "eye", label: "Show all parts", key: "Alt H", run: () => commands.run("show") },
      ...(PartMaps.some(this.store.program.parts)
        ? [null, { label: this.viewport.baked ? "Parts in plain colours" : "Baked colours", run: () => this.viewport.showBaked(!this.viewport.baked) }]
        : []),
      ...this.moreViews(),
    ];
  }

  moreViews: () => (Button | null)[] = () => [];

  /** The assembly file's text, of what the page holds now. */
  text(): string {
    return writeAssembly(this.store.root);
  }

  private get fileName(): string {
    return (this.store.root.name || "assembly").replace(/[^\w.-]+/g, "_").replace(/^\.+/, "");
  }

  private downloads(): (Button | null)[] {
    const { store } = this;
    return [
      { label: "Assembly", key: ".json", run: () => save(writeAssembly(store.root), "application/json", `${this.fileName}.json`) },
      { label: "Mesh to print", key: ".stl", run: () => void this.saveMesh("stl") },
      { label: "Mesh with colours", key: ".glb", run: () => void this.saveMesh("glb") },
      { label: "Shader", key: ".glsl", run: () => void this.saveGlsl() },
      { label: "Picture", key: ".png", run: () => void this.savePicture() },
      ...this.moreDownloads(),
    ];
  }

  private async saveMesh(format: "stl" | "glb"): Promise<void> {
    this.status.value = "Making the mesh …";
    try {
      const [{ mesh }, files] = await Promise.all([import("../mesh/mesher"), import("../mesh/files")]);
      const surface = await mesh(this.store, 160, this.viewport);
      if (this.viewport.learned) files.addTriangles(surface, this.viewport.learned, this.store);
      if (!surface.triangles.length) {
        toast("Nothing of the assembly is inside, so there is no surface.", undefined, true);
        return;
      }
      const data = format === "stl" ? files.toStl(surface, this.store) : files.toGlb(surface, this.store);
      if (format === "stl") tellOfMaps(countTextured(leaves(this.store.root)));
      save(data, format === "stl" ? "model/stl" : "model/gltf-binary", `${this.fileName}.${format}`);
    } catch (error) {
      toast(`The mesh could not be made: ${String(error)}`, undefined, true);
    } finally {
      this.status.value = "";
    }
  }

  private async saveGlsl(): Promise<void> {
    if (this.store.program.parts.some(isLearned)) return toast("A shader cannot hold learned parts; take a mesh.", undefined, true);
    const { toGlsl } = await import("../mesh/glsl");
    tellOfMaps(countTextured(leaves(this.store.root)));
    save(toGlsl(this.store.root), "text/plain", `${this.fileName}.glsl`);
  }

  private async savePicture(): Promise<void> {
    if (!this.viewport.renderer) return toast("There is no picture without WebGL 2.", undefined, true);
    save(await this.viewport.renderer.png(), "image/png", `${this.fileName}.png`);
  }

  private title(): void {
    document.title = `${this.store.root.name || "Assembly"} · Partwright`;
  }

  // Files that are dropped in

  onDrop: (file: File) => void = (file) => void this.openFile(file);

  private dropFiles(): void {
    const { body } = document;
    body.addEventListener("dragover", (event) => {
      event.preventDefault();
      body.classList.add("dropping");
    });
    body.addEventListener("dragleave", (event) => {
      if (!event.relatedTarget) body.classList.remove("dropping");
    });
    body.addEventListener("drop", (event) => {
      event.preventDefault();
      body.classList.remove("dropping");
      const file = event.dataTransfer?.files[0];
      if (file) this.onDrop(file);
    });
  }

  async openFile(file: File): Promise<void> {
    if (!/\.json$/i.test(file.name)) {
      toast(`${file.name}: this page opens assembly files (.json). Shapes are fitted by \`partwright fit\` or \`partwright studio\`.`, undefined, true);
      return;
    }
    try {
      this.store.open(readAssembly(await file.text()), `Open ${file.name}`);
      this.viewport.begin();
    } catch (error) {
      toast(`${file.name}: ${(error as Error).message}`, undefined, true);
    }
  }

  // Looks

  get dark(): boolean {
    const chosen = document.documentElement.dataset.theme;
    return chosen ? chosen === "dark" : window.matchMedia("(prefers-color-scheme: dark)").matches;
  }

  private theme(name: string | null): void {
    if (name === "light" || name === "dark") {
      document.documentElement.dataset.theme = name;
      try {
        localStorage.setItem("partwright-theme", name);
      } catch {
        // Private windows remember nothing.
      }
    }
    this.paint();
  }

  private paint(): void {
    const style = getComputedStyle(document.documentElement);
    const colour = (name: string) => rgb(style.getPropertyValue(name).trim());
    this.viewport.renderer?.setLook({ paper: colour("--stage"), ink: colour("--stage-ink"), accent: colour("--select") });
  }

  private help(): void {
    const rows = Object.values(this.commands.table).map((command) =>
      h("tr", {}, h("td", {}, ...command.keys.flatMap((key, i) => [i ? " or " : "", ...key.split(" ").map((k) => h("kbd", {}, k))])), h("td", {}, command.label)),
    );
    const dialog = h("dialog", { class: "help" });
    dialog.append(
      h("header", {}, h("h2", {}, "How to work here"), button({ icon: "close", label: "Close", run: () => dialog.close() })),
      h(
        "div",
        { class: "body" },
        h("p", {}, "Click a part in the picture or in the list to select it; its numbers appear beside the picture. Every change can be undone, one drag is one step, and nothing is lost when the page is closed."),
        h(
          "ul",
          {},
          h("li", {}, "Look around: drag. Move the view: right-drag, Shift-drag or two fingers. Zoom: wheel or pinch."),
          h("li", {}, "Number fields take sums and fractions (12.5/2); drag their labels, or use the arrow keys."),
          h("li", {}, "Drill a hole: Add, “Hole, where you click”. For any other cut: add a part, put it in its place, then “Taken away” (or the minus key)."),
          h("li", {}, "Make something thicker: raise its dilation, which grows it all round, or its size. Several parts that are one thing to you: select them all, “Merge into one”."),
          h("li", {}, "A part with ×2 or more in the list is repeated: what changes one changes all. “Repeat”, “Each a part of its own” separates them."),
          h("li", {}, "Lock a part that neither edits nor refits may change. Isolate shows what is selected alone."),
        ),
        h("table", {}, ...rows),
      ),
    );
    dialog.addEventListener("close", () => dialog.remove());
    dialog.addEventListener("click", (event) => event.target === dialog && dialog.close());
    document.body.append(dialog);
    dialog.showModal();
  }
}

export function localStorageGet(name: string): string | null {
  try {
    return localStorage.getItem(name);
  } catch {
    return null;
  }
}
