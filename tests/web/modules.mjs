// npm's packages and the messages of the feed, for the tests of the page.

import { execFileSync } from "node:child_process";
import { existsSync, mkdtempSync, readFileSync, readdirSync, rmSync } from "node:fs";
import { createRequire } from "node:module";
import { tmpdir } from "node:os";
import { dirname, join } from "node:path";
import { fileURLToPath, pathToFileURL } from "node:url";

export const here = dirname(fileURLToPath(import.meta.url));
export const project = join(here, "..", "..");
export const page = join(project, "tools", "web", "page");

const ofTests = createRequire(join(here, "npm", "package.json"));
const ofPage = createRequire(join(page, "package.json"));

export const webSockets = () => ofTests("ws");
export const playwright = () => ofTests("playwright-core");
export const axeSource = () => readFileSync(ofTests.resolve("axe-core/axe.min.js"), "utf8");
export const protobuf = () => import(pathToFileURL(ofPage.resolve("@bufbuild/protobuf")).href);
const wellKnown = () => import(pathToFileURL(ofPage.resolve("@bufbuild/protobuf/wkt")).href);

/** The browser of Debian, or the one in MOCAP_CHROMIUM; null: none. */
export function chromium() {
  const candidates = [process.env.MOCAP_CHROMIUM, "/usr/bin/chromium"];
  return candidates.find((path) => path && existsSync(path)) ?? null;
}

/** {create, toBinary, Snapshot, Description, ...}: the messages of proto/mocap/v1 as they are now. */
export async function messages() {
  const library = await protobuf();
  const { FileDescriptorSetSchema } = await wellKnown();
  const folder = mkdtempSync(join(tmpdir(), "mocap-proto-"));
  try {
    const set = join(folder, "set.binpb");
    const files = readdirSync(join(project, "proto", "mocap", "v1")).filter((name) => name.endsWith(".proto"));
    execFileSync("protoc", ["-I", join(project, "proto"), `--descriptor_set_out=${set}`, ...files.map((name) => `mocap/v1/${name}`)]);
    const registry = library.createFileRegistry(library.fromBinary(FileDescriptorSetSchema, readFileSync(set)));
    const schema = (name) => registry.getMessage(`mocap.v1.${name}`);
    return {
      schema,
      encode: (name, fields) => library.toBinary(schema(name), library.create(schema(name), fields)),
      check: (name, json) => library.fromJson(schema(name), json),
    };
  } finally {
    rmSync(folder, { recursive: true });
  }
}
