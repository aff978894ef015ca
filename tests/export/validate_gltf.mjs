// Prints the report of Khronos' glTF validator about a file as JSON.
//
// usage: node validate_gltf.mjs FILE

import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { join } from "node:path";

const validator = createRequire(join(process.env.MOCAP_NODE_MODULES, "x.js"))("gltf-validator");
const report = await validator.validateBytes(new Uint8Array(readFileSync(process.argv[2])));
process.stdout.write(JSON.stringify(report));
