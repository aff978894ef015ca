// Serves the page with simulated data until it is stopped, to work on the page without a daemon.
//
// usage: node stand_in_main.mjs DIST [PORT]     DIST: made by tools/web/page/build.sh

import { StandIn } from "./stand_in.mjs";

const [dist, port = "8080"] = process.argv.slice(2);
if (!dist) {
  console.error("usage: node stand_in_main.mjs DIST [PORT]");
  process.exit(64);
}
const standIn = await StandIn.start(dist, Number(port));
console.log(`stand-in: ${standIn.address}`);
