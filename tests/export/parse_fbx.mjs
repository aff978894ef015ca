// Prints the records of a binary FBX file as npm's fbx-parser reads them, as JSON; 64-bit numbers as text.
//
// usage: node parse_fbx.mjs FILE

import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { join } from "node:path";

const { parseBinary } = createRequire(join(process.env.MOCAP_NODE_MODULES, "x.js"))("fbx-parser");
const plain = (_key, value) => (typeof value === "bigint" ? value.toString() : ArrayBuffer.isView(value) ? [...value] : value);
process.stdout.write(JSON.stringify(parseBinary(readFileSync(process.argv[2])), plain));
