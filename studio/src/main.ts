/** Starts the page with the assembly that stands in it. */

import "./style.css";
import { type GivenMeshes, readMeshes } from "./model/learned";
import { Store } from "./model/store";
import { readAssembly } from "./model/tree";
import { App } from "./ui/app";
import { empty, Live } from "./ui/live";
import { remember } from "./ui/remember";

const data = document.getElementById("assembly")?.textContent;

function complain(text: string): void {
  const message = document.createElement("p");
  message.className = "fatal";
  message.textContent = text;
  document.body.append(message);
}

try {
  const server = document.getElementById("studio")?.textContent;
  if (!data && !server)
    throw new Error("This page holds no assembly. Write one with: partwright export ASSEMBLY -o FILE.html");
  const store = new Store(data ? readAssembly(data) : empty({ unit: "", up: "", input: "" }));
  const app = new App(store);
  const learned = document.getElementById("learned")?.textContent;
  if (learned) app.viewport.setLearned(readMeshes(JSON.parse(learned) as GivenMeshes));
  if (server) Object.assign(window, { live: new Live(store, app, (JSON.parse(server) as { socket: string }).socket) });
  else remember(store, data!);
  // For scripts and tests: what the page holds.
  Object.assign(window, { partwright: app });
} catch (error) {
  complain((error as Error).message);
  throw error;
}
