/** The page when there is a server behind it: edits go to its journal, fits and exports come from it. */

import { surfacePlaces } from "../edit/region";
import type { Step, Store } from "../model/store";
import { type GivenMeshes, isLearned, readMeshes } from "../model/learned";
import { type Group, newGroup, type Part, readAssembly, writeAssembly } from "../model/tree";
import { asMesh, loadInput, type Triangles } from "../server/input";
import { Link } from "../server/link";
import type { Learned, State, Step as SavedStep } from "../server/messages";
import type { Look } from "../view/renderer";
import type { App } from "./app";
import { type Button, button, save, tellOfMaps, toast } from "./controls";
import { h } from "./dom";
import { FitPanel } from "./fit";
import { ImprovePanel } from "./improve";

const LOOKS: [Look["show"], string][] = [
  ["parts", "Parts"],
  ["input", "Input"],
  ["both", "Both"],
];
const UNSENT = "partwright-unsent";

export class Live {
  readonly link: Link;
  readonly fit: FitPanel;
  readonly improve: ImprovePanel;
  private input: Triangles | null = null;
  private inputName = "";
  private state: State | null = null;
  private adopting = false;
  private looks = h("div", { class: "looks choice float", role: "group", "aria-label": "What is shown", hidden: true });
  private banner = h("div", { class: "banner", role: "alert", hidden: true });
  private saveButton = button({ label: "Save", key: "Ctrl S", run: () => this.save() }, true);

  constructor(
    private store: Store,
    private app: App,
    socket: string,
  ) {
    this.fit = new FitPanel(store);
    this.improve = new ImprovePanel(store);
    this.fit.element.append(this.improve.element);
    app.side.prepend(this.fit.element);
    app.addTab("fit", "Fit", this.fit.element);
    document.body.prepend(this.banner);
    for (const [look, label] of LOOKS) {
      const one = h("button", { type: "button", "data-show": look, "aria-pressed": "false" }, label);
      one.addEventListener("click", () => this.show(look, false, false));
      this.looks.append(one);
    }
    app.viewport.element.append(this.looks);
    app.actions.append(this.saveButton);
    document.addEventListener("keydown", (event) => {
      if ((event.ctrlKey || event.metaKey) && event.key.toLowerCase() === "s") {
        event.preventDefault();
        this.save();
      }
    });
    const url = new URL(socket, location.href);
    url.protocol = url.protocol.replace("http", "ws");
    this.link = new Link(url.href);
    this.link.onState = (state) => this.adopt(state);
    this.link.onConnection = (there) => this.connection(there);
    this.link.onMessage = (message) => {
      this.fit.hear(message);
      this.improve.hear(message);
      if (message.type === "accepted") this.decodeSoon();
      if (message.type === "accepted") this.banner.hidden = true;
      if (message.type === "unkept") {
        this.banner.textContent = `Your edits are in this page alone: ${message.message}. It is tried again.`;
        this.banner.hidden = false;
      }
      if (message.type === "fitting" && message.text) this.preview(message.text);
      if (message.type === "fitted") this.store.cancel();
      if (message.type === "failed") {
        this.store.cancel();
        toast(message.message, undefined, true);
      }
      if (message.type === "saved") toast(`Saved to ${message.file}`);
    };
    this.fit.onFit = (fit) => this.link.send(fit) || toast("The server is gone, so nothing can be fitted now.", undefined, true);
    this.fit.onReshape = (reshape) => this.link.send(reshape) || toast("The server is gone, so nothing can be fitted now.", undefined, true);
    this.improve.onImprove = (improve) => this.link.send(improve) || toast("The server is gone, so nothing can be improved now.", undefined, true);
    app.inspector.learnedActions = (part) => this.learnedActions(part);
    this.fit.onBake = () => this.link.send({ type: "bake", size: 128 });
    this.fit.onBox = () => this.drawBox();
    this.fit.onStop = () => this.link.send({ type: "stop" });
    store.onStep = (action, label) => {
      if (this.adopting) return;
      if (action === "commit") this.link.edit({ type: "commit", label, text: writeAssembly(store.root) });
      else this.link.edit({ type: action });
      this.keepUnsent();
    };
    app.viewport.onLost = () => app.viewport.renderer?.setMesh("input", this.input && asMesh(this.input, store));
    app.moreViews = () => this.views();
    app.moreDownloads = () => this.downloads();
    app.onDrop = (file) => void this.drop(file);
    window.addEventListener("beforeunload", (event) => {
      this.keepUnsent();
      if (this.link.waiting.length) event.preventDefault();
    });
  }

  // Learned parts

  private learnedActions(part: Part): HTMLElement[] {
    const ask = (what: Pick<Learned, "action" | "seed" | "source">) => {
      if (!this.link.send({ type: "learned", name: part.name, ...what })) toast("The server is gone, and the model with it.", undefined, true);
    };
    const anew = button({ label: "Sample anew", run: () => ask({ action: "resample", seed: Math.floor(Math.random() * 2 ** 31) }) }, true);
    anew.title = "Another form, drawn from those that the model knows; the other parts adapt";
    const donors = h("select", { "aria-label": "Take it from" }, h("option", { value: "" }, "Take it from …"), ...(this.state?.donors ?? []).map((name) => h("option", { value: name }, name)));
    donors.addEventListener("change", () => donors.value && ask({ action: "swap", source: donors.value }));
    return [h("div", { class: "buttons" }, anew, donors)];
  }

  private decoding = false;
  private decodeTimer = 0;

  /** Asks for the meshes of learned parts as they are now, once edits have paused. */
  private decodeSoon(): void {
    if (!this.store.program.parts.some(isLearned)) return;
    clearTimeout(this.decodeTimer);
    this.decodeTimer = window.setTimeout(() => void this.decode(), 120);
  }

  private async decode(): Promise<void> {
    if (this.decoding) return this.decodeSoon();
    this.decoding = true;
    this.app.status.value = "The parts adapt to one another …";
    try {
      const answer = await fetch("learned");
      const text = await answer.text();
      if (!answer.ok) throw new Error((JSON.parse(text) as { message: string }).message);
      const { revision, meshes } = JSON.parse(text) as { revision: number; meshes: GivenMeshes };
      this.app.viewport.setLearned(readMeshes(meshes));
      if (revision !== this.link.revision) this.decodeSoon();
    } catch (error) {
      if (this.link.there) toast(`The learned parts cannot be shown: ${(error as Error).message}`, undefined, true);
    } finally {
      this.decoding = false;
      this.app.status.value = "";
    }
  }

  /** A box in the picture, over which the input is shown, for a part that is missing. */
  private drawBox(): void {
    const { region } = this.app.viewport;
    if (this.app.viewport.renderer?.look.show === "parts") this.show("both", false, false);
    region.surface ??= this.input && surfacePlaces(this.input.places, this.input.triangles, 20_000);
    region.onFit = ([low, high]) => this.fit.askFor({ action: "box", names: [], box: [...low, ...high] });
    region.begin();
  }

  private connection(there: boolean): void {
    this.banner.hidden = there;
    this.banner.textContent =
      "The server is gone. Go on editing: your changes are kept in this page and sent when it is there again. Start it with the same command as before.";
    if (!there) this.fit.offline();
    else setTimeout(() => this.keepUnsent(), 1000);
  }

  /** Should the tab be closed before the server is back, the browser keeps what it has not got. */
  private keepUnsent(): void {
    try {
      const key = `${UNSENT}-${location.pathname}`;
      if (this.link.there || !this.link.waiting.length) localStorage.removeItem(key);
      else localStorage.setItem(key, writeAssembly(this.store.root));
    } catch {
      // Private windows keep nothing; the tab itself still does.
    }
  }

  private adopt(state: State): void {
    const { store } = this;
    const own = this.link.waiting.length ? writeAssembly(store.root) : this.unsent();
    this.link.waiting.length = 0;
    this.state = state;
    this.adopting = true;
    try {
      const images = new Map(state.images.map(({ name, data }) => [name, data]));
      const read = (text: string): Group => (text ? readAssembly(text, images) : empty(state));
      const steps = (given: SavedStep[]): Step[] => given.map(({ label, text }) => ({ label, root: read(text) }));
      const { box } = state;
      const first = !store.frameBox && !store.program.parts.length;
      store.frameBox = box.length ? [[box[0], box[1], box[2]], [box[3], box[4], box[5]]] : null;
      store.adopt(read(state.text), steps(state.past), steps(state.future));
      if (first || state.input !== this.inputName) this.app.begin();
    } catch (error) {
      toast(`The server's assembly cannot be shown: ${(error as Error).message}`, undefined, true);
    } finally {
      this.adopting = false;
    }
    this.decodeSoon();
    this.showParts();
    if (state.note) toast(state.note);
    if (own && own !== writeAssembly(store.root)) store.commit(readAssembly(own), "Edits of this page");
    this.fit.show(state);
    this.improve.show(state);
    this.saveButton.title = `Save to ${state.file} (Ctrl S)`;
    if (state.input !== this.inputName) void this.showInput(state);
  }

  private unsent(): string | null {
    try {
      const key = `${UNSENT}-${location.pathname}`;
      const text = localStorage.getItem(key);
      localStorage.removeItem(key);
      return text;
    } catch {
      return null;
    }
  }

  /** Whether the input is shown because there were no parts yet. */
  private instead = false;

  private showParts(): void {
    if (this.instead && this.store.program.parts.length) this.show("parts", false, false);
  }

  private preview(text: string): void {
    try {
      this.store.preview(this.store.named(readAssembly(text)));
      this.showParts();
    } catch {
      // A method may pass through what the page cannot show; the result is what counts.
    }
  }

  private async showInput(state: State): Promise<void> {
    this.inputName = state.input;
    const { renderer, region } = this.app.viewport;
    this.input = region.surface = null;
    if (state.input)
      try {
        this.input = await loadInput("input");
      } catch (error) {
        toast(`The input cannot be shown: ${(error as Error).message}`, undefined, true);
      }
    this.looks.hidden = !this.input;
    renderer?.setMesh("input", this.input && asMesh(this.input, this.store));
    this.instead = this.input !== null && !this.store.program.parts.length;
    const look = renderer?.look;
    if (this.instead || !this.input) this.show(this.instead ? "input" : "parts");
    else if (look) this.show(look.show, look.heat, false);
  }

  /** What stands in the picture: the parts, the input, or both. */
  show(show: Look["show"], heat = false, frame = true): void {
    const { viewport } = this.app;
    this.instead &&= show === "input";
    viewport.renderer?.setLook({ show, heat });
    for (const one of this.looks.children) one.setAttribute("aria-pressed", String((one as HTMLElement).dataset.show === (heat ? "" : show)));
    if (frame) viewport.frameAll();
    viewport.wipeHandle(show === "wipe");
    document.body.dataset.show = show;
  }

  private views(): (Button | null)[] {
    if (!this.input) return [];
    const formula = !this.store.program.parts.some(isLearned); // which is what the errors are told by
    return [
      null,
      { label: "The parts", run: () => this.show("parts") },
      { label: "The input", run: () => this.show("input") },
      { label: "One over the other", run: () => this.show("both") },
      { label: "Beside one another", run: () => this.show("beside") },
      { label: "A wipe", run: () => this.show("wipe") },
      ...(formula ? [{ label: "Error on the input", run: () => this.show("input", true) }] : []),
    ];
  }

  private downloads(): (Button | null)[] {
    const { formats, format_names: names } = this.state ?? { formats: [], format_names: [] };
    const own = [".json", ".glsl", ".stl"]; // which the page writes itself
    const label = (format: string, name: string) => (format === ".glb" ? "GLB, each part by itself" : name);
    return [
      null,
      ...formats.flatMap((format, i) => (own.includes(format) ? [] : [{ label: label(format, names[i]), key: format, run: () => void this.download(format) }])),
    ];
  }

  private async download(format: string): Promise<void> {
    try {
      const answer = await fetch(`export?format=${encodeURIComponent(format)}`);
      if (!answer.ok) throw new Error(((await answer.json()) as { message: string }).message);
      const name = /filename\*=UTF-8''(.*)$/.exec(answer.headers.get("content-disposition") ?? "")?.[1] ?? `assembly${format}`;
      save(await answer.arrayBuffer(), "application/octet-stream", decodeURIComponent(name));
      tellOfMaps(Number(answer.headers.get("x-without-maps")));
      const changed = Number(answer.headers.get("x-approximated"));
      if (changed) toast(`${changed} ${changed === 1 ? "part is" : "parts are"} approximated: the format cannot hold ${changed === 1 ? "it" : "them"} exactly.`);
    } catch (error) {
      toast(`${format}: ${(error as Error).message}`, undefined, true);
    }
  }

  private async drop(file: File): Promise<void> {
    this.app.status.value = `Reading ${file.name} …`;
    try {
      const answer = await fetch(`drop?name=${encodeURIComponent(file.name)}`, { method: "POST", body: file });
      if (!answer.ok) throw new Error(((await answer.json()) as { message: string }).message);
    } catch (error) {
      toast(`${file.name}: ${(error as Error).message}`, undefined, true);
    } finally {
      this.app.status.value = "";
    }
  }

  private save(): void {
    if (!this.link.send({ type: "save" })) toast("The server is gone; Download gives you the file meanwhile.", undefined, true);
  }
}

/** Before the first fit there is nothing yet. */
export function empty(state: { unit: string; up: string; input: string }): Group {
  return { ...newGroup("union", [], state.input.replace(/\.[^.]*$/, "")), unit: state.unit || null, up: state.up || null };
}

