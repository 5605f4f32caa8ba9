/** Keeps the edits of a shared file in the browser: a closed tab loses none. */

import type { Store } from "../model/store";
import { readAssembly, writeAssembly } from "../model/tree";
import { toast } from "./controls";

export function remember(store: Store, original: string): void {
  const key = `partwright-edits-${hash(original)}`;
  const first = writeAssembly(store.root);
  try {
    const kept = localStorage.getItem(key);
    if (kept && kept !== first) {
      store.commit(readAssembly(kept), "Earlier edits");
      toast("Your earlier edits of this file are here again.", { label: "Undo them", run: () => store.undo() });
    }
  } catch {
    // A private window keeps nothing, and an older page's edits may not be readable: the file itself is shown.
  }
  let timer = 0;
  const write = () => {
    clearTimeout(timer);
    if (store.previewing) return;
    const text = writeAssembly(store.root);
    try {
      if (text === first) localStorage.removeItem(key);
      else localStorage.setItem(key, text);
    } catch {
      // Nothing to do but to leave the download to the user.
    }
  };
  store.on(["document", "history"], () => {
    clearTimeout(timer);
    timer = window.setTimeout(write, 250);
  });
  window.addEventListener("pagehide", write);
}

/** FNV-1a. */
function hash(text: string): string {
  let value = 0x811c9dc5;
  for (let i = 0; i < text.length; i++) value = Math.imul(value ^ text.charCodeAt(i), 0x01000193) >>> 0;
  return value.toString(16);
}
