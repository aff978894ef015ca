// The page in a real browser, against a stand-in of the server.
//
// usage: node --test page_test.mjs     with MOCAP_PAGE_DIST: folder of the built page

import assert from "node:assert/strict";
import { readdirSync, readFileSync } from "node:fs";
import { join } from "node:path";
import { after, afterEach, before, beforeEach, test } from "node:test";
import { gzipSync } from "node:zlib";
import { kPages, kSizes, startBrowser } from "./browser.mjs";
import { axeSource } from "./modules.mjs";
import { StandIn } from "./stand_in.mjs";

const dist = process.env.MOCAP_PAGE_DIST;
const kPatience_ms = 60000;
const kMaxGzip = 400_000;
const CAMERA_BACK = 5;

let browser;
let standIn;
let contexts = [];
before(async () => {
  browser = await startBrowser();
});
after(() => browser?.close());
beforeEach(async () => {
  standIn = await StandIn.start(dist);
});
afterEach(async () => {
  await Promise.all(contexts.map((context) => context.close()));
  contexts = [];
  await standIn.stop();
});

function refuseWebGl() {
  const original = HTMLCanvasElement.prototype.getContext;
  HTMLCanvasElement.prototype.getContext = function get(kind, ...rest) {
    return kind.startsWith("webgl") ? null : original.call(this, kind, ...rest);
  };
}

/**
 * A page and its faults: errors, content that the browser refused, requests to elsewhere. Without WebGL, unless a test is about it: the
 * processor draws it here, which takes seconds on a busy machine.
 */
async function visit(address, { webgl = false, ...options } = {}) {
  const context = await browser.newContext({ viewport: kSizes[0], reducedMotion: "reduce", ...options });
  contexts.push(context);
  context.setDefaultTimeout(kPatience_ms);
  const page = await context.newPage();
  const faults = [];
  page.on("pageerror", (error) => faults.push(String(error)));
  page.on("console", (message) => message.type() === "error" && !/WebGL/.test(message.text()) && faults.push(message.text()));
  page.on("request", (request) => request.url().startsWith(standIn.address) || faults.push(`request to ${request.url()}`));
  if (!webgl) await page.addInitScript(refuseWebGl);
  await page.goto(`${standIn.address}${address}`);
  return { page, faults };
}

/** Waits until `holds` is true of the stand-in. */
async function until(holds, what) {
  const end = Date.now() + kPatience_ms;
  while (!holds()) {
    assert.ok(Date.now() < end, `not within ${kPatience_ms} ms: ${what}`);
    await new Promise((resolve) => setTimeout(resolve, 10));
  }
}

async function untilDrawn(count) {
  const drawn = standIn.drawn + count;
  await until(() => standIn.drawn >= drawn, `${count} snapshots drawn`);
}

/** The requests of a method that the stand-in received. */
const asked = (method) => standIn.requests.filter((request) => request.method === method).map((request) => request.params);

const silence = (page) => page.locator(".silence");

test("The page has at most 400 kB gzipped", () => {
  const size = readdirSync(dist).reduce((sum, name) => sum + gzipSync(readFileSync(join(dist, name)), { level: 9 }).length, 0);
  assert.ok(size <= kMaxGzip, `${size} bytes`);
});

test("The stage shows subjects and cameras, and acknowledges what it has drawn", async () => {
  const { page, faults } = await visit("#/stage", { webgl: true });

  await page.getByRole("heading", { name: "Anna" }).waitFor();
  await page.getByRole("img", { name: /Anna: tracking/ }).waitFor();
  await page.getByText("camera-prop: 2 of 4 markers are seen").waitFor();
  assert.equal(await page.getByRole("article", { name: /^Camera cam/ }).count(), 8);
  await untilDrawn(5);
  assert.deepEqual(faults, []);
});

test("The picture moves with the persons", async () => {
  const { page } = await visit("#/stage", { webgl: true });
  await page.getByRole("img", { name: /Anna: tracking/ }).waitFor();
  await page.locator(".overlay").evaluate((overlay) => (overlay.hidden = true));

  const pictures = [];
  for (let i = 0; i < 2; i++) {
    await untilDrawn(4);
    pictures.push(await page.locator(".view canvas").first().screenshot());
  }

  assert.ok(!pictures[0].equals(pictures[1]));
});

test("Without WebGL the stage is a map, which moves too", async () => {
  const { page, faults } = await visit("#/stage");
  await page.getByRole("button", { name: "Top view", pressed: true }).waitFor();

  const pictures = [];
  for (let i = 0; i < 2; i++) {
    await untilDrawn(4);
    pictures.push(await page.locator(".view canvas").first().screenshot());
  }

  assert.ok(!pictures[0].equals(pictures[1]));
  assert.deepEqual(faults, []);
});

for (const webgl of [true, false]) {
  test(`Rays and covariances are drawn, and asked for, only while they are on, ${webgl ? "in three dimensions" : "on the map"}`, async () => {
    standIn.still = 60;
    const { page, faults } = await visit("#/stage", { webgl });
    await page.getByRole("img", { name: /Anna: tracking/ }).waitFor();
    await page.getByText("What the picture shows, in words").click();
    const picture = async () => {
      await untilDrawn(6);
      await page.evaluate(() => {
        scrollTo(0, 0); // away from the clock of the header, which stays in view
        for (const part of document.querySelectorAll(".view .tools, .view .legend, .view .overlay")) part.remove(); // they lie over the picture
      });
      return page.locator(".view canvas").first().screenshot();
    };
    const settledPicture = async () => {
      const end = Date.now() + kPatience_ms;
      for (let last = await picture(); ; ) {
        const next = await picture();
        if (next.equals(last)) return next;
        assert.ok(Date.now() < end, `not within ${kPatience_ms} ms: a picture that stays`);
        last = next;
      }
    };
    const wanted = () => [...standIn.viewers][0].topics.has("sightings");
    assert.ok(!wanted());
    const button = (pressed) => page.getByRole("button", { name: "Rays", pressed }).waitFor();
    await button(false);
    await page.keyboard.press("r");
    await button(true);
    await page.getByText("position within 3 σ, 100 times as large").waitFor();
    await page.keyboard.press("r");
    await button(false);
    const before = await settledPicture();

    await page.keyboard.press("r");
    await page.getByText(/^\d+ rays to \d+ markers\. Standard deviation of a measured position: 0\.20.mm/).waitFor();
    assert.ok(wanted());
    const during = await picture();
    await page.keyboard.press("r");
    await until(() => !wanted(), "unsubscribed");
    const after = await settledPicture();

    assert.ok(!before.equals(during));
    assert.ok(before.equals(after));
    assert.deepEqual(faults, []);
  });
}

/** Opens each page in turn, without loading the program anew. */
async function walk(page, look) {
  for (const name of kPages) {
    await page.goto(`${standIn.address}#/${name}`);
    await untilDrawn(2);
    await look(name);
  }
}

test("No page has a fault, breaks the content policy or asks another server", async () => {
  const { page, faults } = await visit("", { webgl: true });
  await walk(page, (name) => assert.deepEqual(faults, [], name));
});

test("Every page fits a phone", async () => {
  const { page } = await visit("", { viewport: kSizes[1] });
  await walk(page, async (name) => {
    const width = await page.evaluate(() => document.documentElement.scrollWidth);
    assert.ok(width <= kSizes[1].width, `${name} is ${width} px wide`);
  });
});

for (const viewport of kSizes) {
  for (const colorScheme of ["dark", "light"]) {
    test(`axe-core has no serious finding on any page at ${viewport.width} px in ${colorScheme}`, async () => {
      const { page } = await visit("", { viewport, colorScheme, bypassCSP: true });
      await page.evaluate(axeSource());
      const found = [];
      await walk(page, async (name) => {
        const { violations } = await page.evaluate(() => globalThis.axe.run(document));
        for (const { id, impact, nodes } of violations) {
          if (impact === "serious" || impact === "critical") found.push(`${name}: ${id}: ${nodes.map((node) => `${node.html} ${node.failureSummary}`).join(" | ")}`);
        }
      });
      assert.deepEqual(found, []);
    });
  }
}

test("The record button starts a take of the slate after the countdown, shows it, and ends it", async () => {
  const { page } = await visit("#/stage");
  await page.getByRole("textbox", { name: "Slate" }).fill("walk");
  await page.getByRole("combobox", { name: "Countdown before the take" }).selectOption("3");

  await page.getByRole("button", { name: "Record a take" }).click();
  await page.getByText("walk_001", { exact: true }).waitFor();
  await page.getByRole("button", { name: "Stop the take walk_001" }).click();
  await page.getByRole("button", { name: "Record a take" }).waitFor();

  assert.deepEqual(asked("take").map(({ action, slate, countdownS }) => ({ action, slate, countdownS })), [
    { action: "ACTION_START", slate: "walk", countdownS: 3 }, { action: "ACTION_STOP", slate: undefined, countdownS: undefined },
  ]);
});

test("The shot list is the daemon's: it is pasted, kept and followed", async () => {
  standIn.shots = [{ name: "old1", slate: "old", notes: "", seconds: 0, done: true }];
  const { page } = await visit("#/takes");
  const list = page.getByRole("region", { name: "Shot list" });
  await list.getByRole("rowheader", { name: "old1" }).waitFor();

  await page.getByRole("button", { name: "Edit" }).click();
  await page.getByLabel(/One shot a line/).fill("walk1\twalk\tto the door\t20\nrun1\trun");
  await page.getByRole("button", { name: "Keep" }).click();
  await list.getByRole("row", { name: /walk1 walk to the door 00:20 next/ }).waitFor();
  await page.getByRole("button", { name: "Next shot" }).click();
  await list.getByRole("row", { name: /walk1 .* taken/ }).waitFor();

  assert.deepEqual(standIn.shots.map(({ name, seconds, done }) => [name, seconds, done]), [["walk1", 20, true], ["run1", 0, false]]);
  await list.getByRole("row", { name: /run1 run .*next/ }).waitFor();
});

test("A refused order is told in the daemon's words", async () => {
  standIn.refusals.set("take", { code: "CODE_FAILED", message: "only 312 MB are free, expected at least 500; delete takes or set [takes] min_free_mb" });
  const { page } = await visit("#/takes");

  await page.getByRole("button", { name: "Record a take" }).click();

  await page.getByText("only 312 MB are free").waitFor();
});

test("A viewer is offered no change", async () => {
  standIn.role = "viewer";
  const { page } = await visit("#/subjects/Anna");
  await page.getByRole("button", { name: "Search now" }).waitFor();

  assert.equal(await page.getByRole("button", { name: "Search now" }).isDisabled(), true);
  assert.equal(await page.getByRole("button", { name: /Record a take/ }).isDisabled(), true);
  await page.keyboard.press("Shift+R");
  await untilDrawn(2);
  assert.deepEqual(standIn.requests, []);
});

test("Orders about subjects, cameras, masks and configuration are requests of the control protocol", async () => {
  const { page } = await visit("#/subjects/Anna");
  await page.getByRole("button", { name: "Search now" }).click();
  await page.getByText("subject: done").first().waitFor();
  await page.goto(`${standIn.address}#/cameras/cam2`);
  await page.getByLabel("Exposure, µs").fill("750");
  await page.getByRole("button", { name: "Set", exact: true }).click();
  await page.getByText("camera: done").waitFor();
  await page.goto(`${standIn.address}#/calibrate`);
  await page.getByRole("button", { name: "Learn masks" }).click();
  await page.getByText("mask: done").waitFor();
  await page.getByRole("button", { name: "Reload" }).click();
  await page.getByText("reload: done").waitFor();

  assert.deepEqual(standIn.requests, [
    { method: "subject", params: { action: "ACTION_ADD", name: "Anna" } }, { method: "camera", params: { name: "cam2", exposureUs: 750 } },
    { method: "mask", params: { camera: "", images: 100 } }, { method: "reload", params: {} },
  ]);
});

const kReport = {
  name: "Cara", residual_mm: 4.25, unknown: ["Sword1"], twice: [], never_seen: 1, ghosts: 7, model_outputs: 12, asymmetric: [["LASI", "RASI"]],
  bones: [{ name: "Hips" }, { name: "Chest" }], markers: [{ name: "LASI", bone: "Hips" }, { name: "RASI", bone: "Hips" }],
};

test("A subject is added from a C3D file, and the page says what the file has and lacks", async () => {
  standIn.imported = { status: 200, answer: { code: "CODE_DONE", message: "the subject is searched", report: kReport, warnings: ["label 'Sword1' is unknown; left out"] } };
  const { page, faults } = await visit("#/subjects");
  const panel = page.getByRole("region", { name: "Add from a C3D file" }), send = panel.getByRole("button", { name: "Import and add" });
  await panel.getByLabel("C3D file, at most 8 MiB").setInputFiles({ name: "static.c3d", mimeType: "application/octet-stream", buffer: Buffer.alloc(3000, 2) });
  assert.ok(await send.isDisabled());
  await panel.getByLabel("Name of the subject").fill("Cara 2");

  await send.click();

  await panel.getByText("the subject is searched").waitFor();
  const report = panel.getByRole("region", { name: "What the file has" });
  for (const text of ["2: LASI, RASI", "Chest", "Sword1", "LASI and RASI", "4.3\u2009mm", "label 'Sword1' is unknown; left out"]) await report.getByText(text, { exact: true }).waitFor();
  assert.deepEqual(standIn.uploads, [{ method: "POST", type: "application/octet-stream", name: "Cara 2", atRest: "true", bytes: 3000 }]);
  assert.deepEqual(faults, []);
});

test("A C3D file that is refused is told in the words of the import, and one that is too large is not sent", async () => {
  standIn.imported = { status: 422, answer: { code: "CODE_FAILED", message: "upload.c3d: not a C3D file: byte 2 is 0, expected 80" } };
  const { page } = await visit("#/subjects");
  const panel = page.getByRole("region", { name: "Add from a C3D file" });
  await panel.getByLabel("Name of the subject").fill("Cara");
  const send = async (bytes) => {
    await panel.getByLabel("C3D file, at most 8 MiB").setInputFiles({ name: "walk.c3d", mimeType: "application/octet-stream", buffer: Buffer.alloc(bytes) });
    await panel.getByRole("button", { name: "Import and add" }).click();
  };

  await send(8 * 1024 * 1024 + 1);
  await panel.getByText("walk.c3d has 8.0 MiB, expected at most 8 MiB").waitFor();
  assert.equal(standIn.uploads.length, 0);
  await send(100);

  await panel.getByText("upload.c3d: not a C3D file: byte 2 is 0, expected 80").waitFor();
});

/** Drags or clicks at places of the picture, given in pixels of the camera's image. */
async function pointers(page) {
  const box = await page.locator("svg.masks").boundingBox();
  const scale = Math.min(box.width / 1280, box.height / 1024);
  const at = ([u, v]) => [box.x + (box.width - 1280 * scale) / 2 + scale * (u + 0.5), box.y + (box.height - 1024 * scale) / 2 + scale * (v + 0.5)];
  return {
    click: (corner) => page.mouse.click(...at(corner)),
    drag: async (from, to) => {
      await page.mouse.move(...at(from));
      await page.mouse.down();
      await page.mouse.move(...at(to), { steps: 3 });
      await page.mouse.up();
    },
  };
}

test("Masks are drawn as rectangles and polygons, applied, removed and undone", async () => {
  const { page, faults } = await visit("#/cameras/cam1");
  await page.getByRole("img", { name: "0 drawn and 1 learnt masks" }).waitFor();
  const apply = page.getByRole("button", { name: "Apply" }), undo = page.getByRole("button", { name: "Undo" });
  assert.ok(await apply.isDisabled() && await undo.isDisabled());
  const pointer = await pointers(page);
  const near_px = (actual, expected) => actual.forEach((value, i) => assert.ok(Math.abs(value - expected[i]) <= 4, `${actual} is not ${expected}`));

  await page.getByRole("button", { name: "Mask a rectangle" }).click();
  await pointer.drag([900, 700], [1100, 800]);
  await page.getByRole("button", { name: "Mask a polygon" }).click();
  await pointer.drag([100, 100], [100, 100]);
  for (const corner of [[300, 100], [200, 300], [100, 100]]) await pointer.click(corner);
  await pointer.click([600, 600]);
  await page.keyboard.press("Escape");
  await page.getByText("Not applied yet.").waitFor();
  assert.deepEqual(standIn.requests, []);
  await apply.click();
  await page.getByText("mask: done").waitFor();

  const [{ action, camera, polygons }] = asked("mask");
  assert.deepEqual([action, camera, polygons.length], ["ACTION_DRAW", "cam1", 2]);
  near_px(polygons[0].xPx, [900, 1100, 1100, 900]);
  near_px(polygons[0].yPx, [700, 700, 800, 800]);
  near_px(polygons[1].xPx, [100, 300, 200]);
  near_px(polygons[1].yPx, [100, 100, 300]);
  await page.getByRole("img", { name: "2 drawn and 1 learnt masks" }).waitFor();

  await page.getByRole("button", { name: "Remove mask 1" }).click();
  await page.getByText("Rectangle by numbers").click();
  for (const [name, value] of [["Left", "10"], ["Top", "20"], ["Width", "30"], ["Height", "40"]]) await page.getByLabel(`${name}, px`).fill(value);
  await page.getByRole("button", { name: "Add the rectangle" }).click();
  await page.getByText("2: rectangle at 10, 20: 30 × 40 px").waitFor();
  await apply.click();
  await until(() => asked("mask").length === 2, "the second order");
  assert.deepEqual(asked("mask")[1].polygons[1], { xPx: [9.5, 39.5, 39.5, 9.5], yPx: [19.5, 19.5, 59.5, 59.5] });
  await undo.click();
  await page.getByText(/^1: rectangle at \d+, \d+: \d+ × \d+ px$/).waitFor();
  await undo.click();
  await page.getByText("No drawn mask.").waitFor();
  assert.ok(await undo.isDisabled());
  await page.getByRole("button", { name: "Forget learnt" }).click();
  await page.getByRole("img", { name: "0 drawn and 0 learnt masks" }).waitFor();
  assert.deepEqual(faults, []);
});

test("A viewer sees the masks and cannot draw any", async () => {
  standIn.role = "viewer";
  const { page } = await visit("#/cameras/cam1");
  await page.getByRole("img", { name: "0 drawn and 1 learnt masks" }).waitFor();

  await page.getByRole("button", { name: "Mask a rectangle" }).click();
  await (await pointers(page)).drag([900, 700], [1100, 800]);

  await page.getByText("No drawn mask.").waitFor();
  assert.equal(await page.getByText("Not applied yet.").count(), 0);
});

test("A wand calibration goes from the first image to a rig in force, and back to an earlier rig", async () => {
  const { page } = await visit("#/calibrate");
  const wand = page.getByRole("region", { name: "Wand", exact: true }), earlier = page.getByRole("region", { name: "Earlier rigs" }).first();
  await earlier.getByText("None yet").waitFor();
  await wand.getByLabel("Lenses").selectOption("unknown");
  await wand.getByLabel(/field of view/).fill("70");
  for (const rigs of [1, 2]) {
    standIn.calibration.waved = false;
    await wand.getByRole("button", { name: "Start waving" }).click();
    await wand.getByText(/wave in the common view of cam1/).waitFor();
    standIn.calibration.waved = true;
    await wand.getByText("Enough samples: solve, or go on waving.").waitFor();
    await wand.getByRole("img", { name: "100 % of the image of camera cam1 has seen the wand" }).waitFor();
    await wand.getByRole("button", { name: "Solve" }).click();
    await wand.getByText("good: 0.080 px rms", { exact: false }).waitFor();
    await wand.getByRole("button", { name: "Apply" }).click();
    await wand.getByText("The rig is in force.").waitFor();
    await earlier.getByText(`2026-03-0${rigs}T09-30-00Z`).waitFor();
  }
  await earlier.getByRole("button", { name: "Restore" }).click();
  await earlier.getByRole("row", { name: /2026-03-01.*in force/ }).waitFor();

  assert.deepEqual(standIn.requests[0], { method: "calibration", params: { action: "ACTION_WAND", wandM: [0, 0.16, 0.5], fovDeg: 70 } });
  assert.deepEqual(standIn.requests.slice(1).map(({ params }) => params.action), ["ACTION_SOLVE", "ACTION_APPLY", "ACTION_WAND", "ACTION_SOLVE", "ACTION_APPLY", "ACTION_RESTORE"]);
});

test("A wand calibration replaces calibrated lenses on request", async () => {
  const { page } = await visit("#/calibrate");
  const wand = page.getByRole("region", { name: "Wand", exact: true });
  await wand.getByLabel("Lenses").selectOption("all estimated anew");
  await wand.getByLabel(/field of view/).fill("70");

  await wand.getByRole("button", { name: "Start waving" }).click();
  await wand.getByText(/wave in the common view of cam1/).waitFor();

  assert.deepEqual(standIn.requests[0].params, { action: "ACTION_WAND", wandM: [0, 0.16, 0.5], fovDeg: 70, refineLens: true });
});

test("The floor is measured with a floor frame", async () => {
  const { page } = await visit("#/calibrate");
  const floor = page.getByRole("region", { name: "Floor", exact: true });
  await floor.getByLabel(/Long and short arm/).fill("500, 300");
  await floor.getByLabel(/above the floor/).fill("12");
  await floor.getByRole("button", { name: "Measure the floor" }).click();
  await floor.getByText("within 0.4").waitFor();
  await floor.getByRole("button", { name: "Apply" }).click();
  await floor.getByText("The rig is in force.").waitFor();

  assert.deepEqual(standIn.requests.map(({ params }) => params), [
    { action: "ACTION_FLOOR", floor: { method: "METHOD_FRAME", heightM: 0.012, longM: 0.5, shortM: 0.3 } }, { action: "ACTION_APPLY" },
  ]);
});

test("A floor that three markers give is called unchecked", async () => {
  const { page } = await visit("#/calibrate");
  const floor = page.getByRole("region", { name: "Floor", exact: true });
  await floor.getByLabel("With").selectOption("METHOD_MARKERS");
  await floor.getByRole("button", { name: "Measure the floor" }).click();
  await floor.getByText("lay a fourth one").waitFor();

  assert.equal(await floor.getByText("The markers lie within").count(), 0);
});

test("A wand that is no wand cannot be waved", async () => {
  const { page } = await visit("#/calibrate");
  await page.getByLabel(/Its markers from one end/).fill("0, 500, 160");

  assert.equal(await page.getByRole("button", { name: "Start waving" }).isDisabled(), true);
  assert.deepEqual(standIn.requests, []);
});

test("Faults of the configuration are listed with file and line", async () => {
  standIn.refusals.set("reload", { code: "CODE_INVALID", message: "config/my.toml:14:15: camera 'cam1': exposure_us is 25000, expected 10 to 20000" });
  const { page } = await visit("#/setup");

  await page.getByRole("button", { name: "Reload" }).click();

  await page.getByRole("row", { name: "config/my.toml 14 15 camera 'cam1': exposure_us is 25000, expected 10 to 20000" }).waitFor();
});

test("When the data stop, the page says since when over the whole view, and shows data again by itself", async () => {
  const { page } = await visit("#/stage");
  await page.getByRole("img", { name: /Anna: tracking/ }).waitFor();
  assert.equal(await silence(page).count(), 0);

  standIn.sending = false;
  await silence(page).getByText(/No data since [0-9]+.s/).waitFor();
  standIn.sending = true;

  await silence(page).waitFor({ state: "detached" });
});

test("The page connects again by itself", async () => {
  const { page } = await visit("#/stage");
  await page.getByRole("img", { name: /Anna: tracking/ }).waitFor();

  standIn.cut();
  await until(() => standIn.viewers.size === 0, "cut");
  await until(() => standIn.viewers.size === 1, "connected again");

  await untilDrawn(5);
  await silence(page).waitFor({ state: "detached" });
});

test("The page says why the server has no daemon", async () => {
  standIn.connected = false;
  standIn.sending = false;
  standIn.reason = "nothing listens at tcp://127.0.0.1:5570; start mocapd";
  const { page } = await visit("#/stage");

  await silence(page).getByText("nothing listens at tcp://127.0.0.1:5570; start mocapd").waitFor();
});

test("A hidden page takes no snapshots, and takes them again when it is shown", async () => {
  const { page } = await visit("#/stage");
  await untilDrawn(2);
  const hide = (hidden) => page.evaluate((now) => {
    Object.defineProperty(document, "hidden", { value: now, configurable: true });
    document.dispatchEvent(new Event("visibilitychange"));
  }, hidden);
  const topics = () => [...[...standIn.viewers][0].topics];

  await hide(true);
  await until(() => !topics().includes("snapshot"), "unsubscribed");
  assert.deepEqual(topics(), ["description", "event"]);
  await hide(false);

  await until(() => topics().includes("snapshot"), "subscribed again");
  await untilDrawn(2);
});

test("The keyboard does what its list says", async () => {
  const { page } = await visit("#/stage");
  await page.getByRole("heading", { name: "Anna" }).waitFor();

  await page.keyboard.press("?");
  await page.getByRole("dialog", { name: "Keyboard" }).getByText("Follow the next subject").waitFor();
  await page.keyboard.press("Escape");
  await page.keyboard.press("f");
  await page.getByRole("button", { name: "Follow Anna", pressed: true }).waitFor();
  await page.keyboard.press("3");
  await page.getByRole("table", { name: /Changes of the label/ }).first().waitFor();
  await page.getByRole("textbox", { name: "Slate" }).press("1"); // a letter of the slate, not the page 1
  assert.match(page.url(), /#\/subjects/);
  await page.getByRole("textbox", { name: "Slate" }).blur();
  await page.keyboard.press("Shift+R");

  await until(() => asked("take").length === 1, "record by key");
});

test("The health light and the page Health give the findings of preflight", async () => {
  standIn.findings.push({ check: "camera cam5", verdict: "bad", what: "deviates from the rig by 6.5 px", cure: "mocap-calibrate refine" });
  const { page } = await visit("#/health");

  const ready = page.getByRole("region", { name: "Ready to record?" });
  await ready.getByText("mocap-calibrate refine").waitFor();
  assert.equal(await ready.getByRole("listitem").count(), 4);
  await page.getByRole("button", { name: "Health: Bad. Show the reasons" }).click();
  await page.getByRole("dialog").getByText("Camera cam5: deviates from the rig by 6.5 px.").waitFor();
});

test("A take is played, stepped and scrubbed, and is not taken for live", async () => {
  const { page, faults } = await visit("#/takes");
  await page.getByRole("link", { name: "walk_002" }).click();
  const take = page.getByRole("region", { name: "Take walk_002, not live" });
  await take.getByText("Take, not live").waitFor();
  await take.getByRole("img", { name: /Anna: tracking/ }).waitFor();
  const slider = take.getByRole("slider", { name: "Position in the take" });
  const position = () => slider.inputValue().then(Number);

  await slider.fill("4");
  assert.equal(await position(), 4);
  await page.keyboard.press("ArrowRight");
  assert.ok((await position()) > 4);
  await slider.evaluate((element) => element.blur());
  await page.keyboard.press("j");
  assert.ok((await position()) < 3.5);
  await page.getByRole("button", { name: "Play" }).click();
  await page.getByRole("button", { name: "Pause" }).waitFor();
  const before = await position();
  await page.waitForFunction((from) => Number(document.querySelector(".player input").value) > from, before);
  await page.getByRole("button", { name: "Play" }).waitFor();

  assert.equal(await position(), 6);
  standIn.sending = false;
  await page.getByRole("link", { name: "All takes" }).click();
  await silence(page).waitFor();
  await page.goBack();
  await silence(page).waitFor({ state: "detached" });
  assert.deepEqual(faults, []);
});

test("A take is rated, exported, downloaded, renamed and deleted", async () => {
  const { page } = await visit("#/takes/walk_001");
  await page.getByRole("textbox", { name: "Notes" }).fill("again");
  await page.getByLabel("Rating, 5 is the best").selectOption("4");
  await page.getByRole("button", { name: "Keep" }).click();
  await page.getByText("walk_001: done").waitFor();

  await page.getByLabel("Format").selectOption("bvh");
  const exported = page.waitForEvent("download");
  await page.getByRole("button", { name: "Export" }).click();
  assert.match((await exported).url(), /\/takes\/walk_001\.bvh$/);
  const downloaded = page.waitForEvent("download");
  await page.getByRole("link", { name: "Download" }).click();
  assert.match((await downloaded).url(), /\/takes\/walk_001\.mcap$/);
  standIn.takes.exportFault = "subject 'prop' has no bones; export the others with --subject";
  await page.getByRole("button", { name: "Export" }).click();
  await page.getByText("subject 'prop' has no bones").waitFor();
  await page.getByRole("button", { name: "Check" }).click();
  await page.getByText("Every checksum and every message is right.").waitFor();

  await page.getByRole("textbox", { name: "Name" }).fill("walk best");
  await page.getByRole("button", { name: "Rename" }).click();
  await page.getByRole("region", { name: "Take walk best, not live" }).waitFor();
  page.on("dialog", (dialog) => dialog.accept());
  await page.getByRole("button", { name: "Delete" }).click();
  await page.getByRole("link", { name: "walk_002" }).waitFor();

  assert.deepEqual(standIn.takes.changes, [
    { name: "walk_001", verb: "edit", params: { notes: "again", tags: [], rating: 4 } }, { name: "walk_001", verb: "rename", params: { name: "walk best" } },
    { name: "walk best", verb: "delete", params: {} },
  ]);
});

test("Events are listed and filtered", async () => {
  const { page } = await visit("#/health");
  await until(() => [...standIn.viewers].some((viewer) => viewer.topics.has("event")), "subscribed to events");

  standIn.event(CAMERA_BACK, { camera: 2 });
  standIn.event(1, { subject: 0 });
  await page.getByRole("row", { name: /camera back cam3/ }).waitFor();
  await page.getByRole("searchbox", { name: "Filter the events" }).fill("anna");

  await page.getByRole("row", { name: /camera back cam3/ }).waitFor({ state: "detached" });
  await page.getByRole("row", { name: /subject found Anna/ }).waitFor();
});

test("A name with markup is shown as text", async () => {
  standIn.daemon.subjects[0].name = "<img src=x onerror=alert(1)>";
  const { page, faults } = await visit("#/stage");

  await page.getByRole("heading", { name: "<img src=x onerror=alert(1)>" }).waitFor();

  assert.deepEqual(faults, []);
});
