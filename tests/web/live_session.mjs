// An operator's session in a browser, at the page of a real daemon: one step of it.
//
// usage: live_session.mjs URL wand|floor|take FOLDER     FOLDER: receives downloads; exit code 77: no browser

import assert from "node:assert/strict";
import { statSync } from "node:fs";
import { join } from "node:path";
import { kSizes, startBrowser } from "./browser.mjs";
import { chromium } from "./modules.mjs";

// Cameras are simulated, images are searched and a rig is computed beside the browser.
const kPatience_ms = 240000;
const kTakeLength_ms = 3000;

async function wand(page, address) {
  await page.goto(`${address}/#/calibrate`);
  const panel = page.getByRole("region", { name: "Wand", exact: true });
  await panel.getByLabel("Lenses").selectOption("unknown");
  await panel.getByRole("button", { name: "Start waving" }).click();
  await panel.getByText("Enough samples: solve, or go on waving.").waitFor();
  await panel.getByRole("button", { name: "Solve" }).click();
  await panel.getByText(/The floor is provisional/).waitFor();
  await panel.getByRole("button", { name: "Apply" }).click();
  await panel.getByText("The rig is in force.").waitFor();
}

// The frame is measured again until the cameras see it: they have just been connected.
async function floor(page, address) {
  await page.goto(`${address}/#/calibrate`);
  const panel = page.getByRole("region", { name: "Floor", exact: true });
  const apply = panel.getByRole("button", { name: "Apply" });
  do {
    await panel.getByRole("button", { name: "Measure the floor" }).click();
    await panel.getByText(/leave the floor frame still/).waitFor();
    await apply.or(panel.getByText(/^No result/)).waitFor();
  } while (!(await apply.isVisible()));
  await apply.click();
  await panel.getByText("The rig is in force.").waitFor();
}

async function take(page, address, folder) {
  await page.goto(`${address}/#/stage`);
  await page.getByRole("img", { name: /actor: tracking/ }).waitFor();
  await page.getByRole("textbox", { name: "Slate" }).fill("walk");
  await page.getByRole("button", { name: "Record a take" }).click();
  const stop = page.getByRole("button", { name: "Stop the take walk_001" });
  await stop.waitFor();
  await page.waitForTimeout(kTakeLength_ms);
  await stop.click();
  await page.getByRole("button", { name: "Record a take" }).waitFor();
  await page.goto(`${address}/#/takes`);
  await page.getByRole("link", { name: "walk_001" }).click();
  await page.getByLabel("Format").selectOption("c3d");
  for (const [role, name, file] of [["button", "Export", "walk.c3d"], ["link", "Download", "walk.mcap"]]) {
    const download = page.waitForEvent("download");
    await page.getByRole(role, { name }).click();
    await (await download).saveAs(join(folder, file));
    assert.ok(statSync(join(folder, file)).size > 10000, `${file} is too small for ${kTakeLength_ms} ms`);
  }
}

const [address, step, folder] = process.argv.slice(2);
if (!chromium()) process.exit(77);
const browser = await startBrowser();
const page = await browser.newPage({ viewport: kSizes[0], reducedMotion: "reduce" });
page.setDefaultTimeout(kPatience_ms);
try {
  await { wand, floor, take }[step](page, address, folder);
} catch (error) {
  await page.screenshot({ path: join(folder, `${step}.png`) });
  throw error;
} finally {
  await browser.close();
}
