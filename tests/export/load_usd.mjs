// Reads a USD file with npm's tinyusdz and prints {"error", "meshes"} as JSON; the error is empty if the file is right.
//
// usage: node load_usd.mjs FILE

import { readFileSync } from "node:fs";
import { join } from "node:path";
import { pathToFileURL } from "node:url";

// The library is built for browsers and refuses to start elsewhere.
globalThis.window = globalThis;
process.type = "renderer";

const folder = join(process.env.MOCAP_NODE_MODULES, "tinyusdz");
const { default: start } = await import(pathToFileURL(join(folder, "tinyusdz.js")));
const library = await start({ wasmBinary: readFileSync(join(folder, "tinyusdz.wasm")) });
const stage = new library.TinyUSDZLoaderNative();
const ok = stage.loadFromBinary(new Uint8Array(readFileSync(process.argv[2])), "clip.usda");
process.stdout.write(JSON.stringify({ error: ok ? "" : stage.error(), meshes: ok ? stage.numMeshes() : 0 }));
