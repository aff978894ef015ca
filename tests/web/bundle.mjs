// The page's modules without its DOM, bundled for Node: tests call them directly.

import { execFileSync } from "node:child_process";
import { mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { pathToFileURL } from "node:url";
import { page } from "./modules.mjs";

/** Imports modules of tools/web/page/src by their paths without ".ts"; all share one bundle. */
export async function pageModules(...names) {
  const folder = mkdtempSync(join(tmpdir(), "mocap-page-"));
  process.on("exit", () => rmSync(folder, { recursive: true, force: true }));
  const files = names.map((name) => join(page, "src", `${name}.ts`));
  execFileSync("esbuild", [...files, "--bundle", "--splitting", "--format=esm", "--platform=node", "--out-extension:.js=.mjs", "--log-level=warning",
    `--outbase=${join(page, "src")}`, `--outdir=${folder}`]);
  return Promise.all(names.map((name) => import(pathToFileURL(join(folder, `${name}.mjs`)).href)));
}
