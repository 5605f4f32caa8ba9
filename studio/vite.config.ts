import { createHash } from "node:crypto";
import { readdirSync, readFileSync } from "node:fs";
import { join, relative } from "node:path";
import { defineConfig, type Plugin } from "vite";
import { viteSingleFile } from "vite-plugin-singlefile";

/** Every file that the page is made of, in a fixed order: partwright's tests compute the same hash without Node. */
function sourceHash(root: string): string {
  const files = ["index.html", "package.json", "package-lock.json", "tsconfig.json", "vite.config.ts"];
  for (const formula of ["distance", "superfrustum", "quadric", "profile", "pipe"]) files.push(`../partwright/export/${formula}.glsl`);
  for (const entry of readdirSync(join(root, "src"), { recursive: true, withFileTypes: true })) {
    if (entry.isFile()) files.push(relative(root, join(entry.parentPath, entry.name)).replaceAll("\\", "/"));
  }
  const hash = createHash("sha256");
  for (const file of files.sort()) hash.update(file + "\0").update(readFileSync(join(root, file))).update("\0");
  return hash.digest("hex");
}

function recordSources(): Plugin {
  return {
    name: "record-sources",
    transformIndexHtml: (html) => html.replace("SOURCES", sourceHash(import.meta.dirname)),
  };
}

export default defineConfig({
  plugins: [recordSources(), viteSingleFile({ removeViteModuleLoader: true })],
  build: { outDir: "build", target: "es2022", license: false },
  worker: { format: "iife" },
});
