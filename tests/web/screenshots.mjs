// Takes a screenshot of every page at 1280 and at 390 px, in dark and light.
//
// usage: node screenshots.mjs OUTDIR [ADDRESS]     with MOCAP_PAGE_DIST: folder of the built page
//   ADDRESS   of a running mocap-web (http://127.0.0.1:8080/); default: the page with simulated data

import { mkdirSync } from "node:fs";
import { join } from "node:path";
import { kPages, kSizes, startBrowser } from "./browser.mjs";
import { StandIn } from "./stand_in.mjs";

const [out, given] = process.argv.slice(2);
if (!out) {
  console.error("usage: node screenshots.mjs OUTDIR [ADDRESS]");
  process.exit(64);
}
const kPatience_ms = 120000;
mkdirSync(out, { recursive: true });
const standIn = given ? null : await StandIn.start(process.env.MOCAP_PAGE_DIST);
const address = given ?? standIn.address;
const browser = await startBrowser();

/** Waits until the page shows data, as a person would before looking. */
async function settled(page, name) {
  await page.getByText(/^(Good|Look|Bad)$/).first().waitFor();
  await page.locator(".silence").waitFor({ state: "detached" });
  await page.waitForTimeout(name === "health" ? 5000 : 2000); // graphs and trails need some seconds of data
}

for (const colorScheme of ["dark", "light"]) {
  for (const viewport of kSizes) {
    const context = await browser.newContext({ viewport, colorScheme });
    context.setDefaultTimeout(kPatience_ms);
    const page = await context.newPage();
    for (const name of kPages) {
      await page.goto(`${address}#/${name}`);
      await settled(page, name);
      const file = `${name.replace("/", "_")}_${viewport.width}_${colorScheme}.png`;
      await page.screenshot({ path: join(out, file), fullPage: name !== "monitor" });
      console.log(file);
    }
    await context.close();
  }
}
await browser.close();
await standIn?.stop();
