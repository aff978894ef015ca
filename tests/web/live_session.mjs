// An operator's session in a browser, at the page of a real daemon: one step of it.
//
// usage: live_session.mjs URL wand|floor|take|rays|mask|import FOLDER     FOLDER: receives downloads, has stand.c3d; exit code 77: no browser

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

// The frame is measured again until the cameras see it: they have just been connected. From the click to the result the
// button has another name or is absent.
async function floor(page, address) {
  await page.goto(`${address}/#/calibrate`);
  const panel = page.getByRole("region", { name: "Floor", exact: true });
  const apply = panel.getByRole("button", { name: "Apply" });
  const measure = panel.getByRole("button", { name: "Measure the floor", exact: true });
  do {
    await measure.click();
    await measure.waitFor();
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

async function rays(page, address) {
  await page.goto(`${address}/#/stage`);
  await page.getByRole("img", { name: /actor: tracking/ }).waitFor();
  await page.getByText("What the picture shows, in words").click();
  await page.keyboard.press("r");
  await page.getByText(/^\d\d+ rays to [1-9]\d* markers\. Standard deviation of a measured position: 0\.\d/).waitFor();
}

/** Masks most of the image of cam1, sees its blobs vanish, and undoes it. */
async function mask(page, address) {
  await page.goto(`${address}/#/cameras/cam1`);
  const blobs = page.locator(".figures").getByText(/^\d+ blobs$/);
  const count = async () => parseInt(await blobs.innerText(), 10);
  const until = async (holds) => {
    while (!holds(await count())) await page.waitForTimeout(100);
  };
  await page.getByRole("img", { name: "0 drawn and 0 learnt masks" }).waitFor();
  await until((now) => now > 10);
  await page.getByRole("button", { name: "Mask a rectangle" }).click();
  const box = await page.locator("svg.masks").boundingBox();
  await page.mouse.move(box.x + 1, box.y + 1);
  await page.mouse.down();
  await page.mouse.move(box.x + box.width - 1, box.y + 0.85 * box.height, { steps: 3 });
  await page.mouse.up();
  await page.getByRole("button", { name: "Apply" }).click();
  await page.getByText(/camera 'cam1': 1 drawn masks, 8\d\.\d+ % of the image/).waitFor();
  await until((now) => now < 5);
  await page.getByRole("button", { name: "Undo" }).click();
  await page.getByRole("img", { name: "0 drawn and 0 learnt masks" }).waitFor();
  await until((now) => now > 10);
}

async function importSubject(page, address, from) {
  await page.goto(`${address}/#/subjects`);
  const panel = page.getByRole("region", { name: "Add from a C3D file" });
  await panel.getByLabel("C3D file, at most 8 MiB").setInputFiles(join(from, "stand.c3d"));
  await panel.getByLabel("Name of the subject").fill("cara");
  await panel.getByRole("button", { name: "Import and add" }).click();
  await panel.getByText(/is in force/).waitFor();
  await panel.getByRole("region", { name: "What the file has" }).getByText(/^\d+: \w+/).waitFor();
  await page.getByRole("link", { name: "cara", exact: true }).first().click();
  await page.getByRole("heading", { name: "cara" }).first().waitFor();
}

const [address, step, folder] = process.argv.slice(2);
if (!chromium()) process.exit(77);
const browser = await startBrowser();
const page = await browser.newPage({ viewport: kSizes[0], reducedMotion: "reduce" });
page.setDefaultTimeout(kPatience_ms);
try {
  await { wand, floor, take, rays, mask, import: importSubject }[step](page, address, folder);
} catch (error) {
  await page.screenshot({ path: join(folder, `${step}.png`) });
  throw error;
} finally {
  await browser.close();
}
