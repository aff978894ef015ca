// Opens the page Stage in a browser, as measure.py does, and prints one JSON object:
//   first_paint_ms   from the navigation to the first content (Paint Timing), in a browser that runs and has no cache of the page
//   drawn            [number of a snapshot, UTC in ms when the page said that it was drawn], in order
//   heap_bytes       memory of the page's objects once a minute, after a collection
//
// usage: measure_page.mjs URL SECONDS                 exit code 77: no browser

import { startBrowser } from "./browser.mjs";

const kMinute_ms = 60000;

// Runs in the page before its own code.
function noteDrawn() {
  window.drawnTimes = [];
  const send = WebSocket.prototype.send;
  WebSocket.prototype.send = function (message) {
    const number = typeof message === "string" ? JSON.parse(message).drawn : undefined;
    if (number !== undefined) window.drawnTimes.push([Number(number), Date.now()]);
    return send.call(this, message);
  };
}

async function heapBytes(tools) {
  await tools.send("HeapProfiler.collectGarbage");
  const { metrics } = await tools.send("Performance.getMetrics");
  return metrics.find((metric) => metric.name === "JSHeapUsedSize").value;
}

async function measure(page, url, seconds) {
  await page.addInitScript(noteDrawn);
  await page.goto(`${url}/#/stage`);
  await page.getByRole("img", { name: /actor: tracking/ }).waitFor();
  const tools = await page.context().newCDPSession(page);
  await tools.send("Performance.enable");
  const drawn = [];
  const heap = [];
  const end = Date.now() + 1000 * seconds;
  for (let next = Date.now(); Date.now() < end; ) {
    if (Date.now() >= next) {
      heap.push(await heapBytes(tools));
      next += kMinute_ms;
    }
    await page.waitForTimeout(Math.min(1000, Math.max(0, end - Date.now())));
    drawn.push(...(await page.evaluate(() => window.drawnTimes.splice(0))));
  }
  heap.push(await heapBytes(tools));
  const first_paint_ms = await page.evaluate(() => performance.getEntriesByName("first-contentful-paint")[0].startTime);
  return { first_paint_ms, drawn, heap_bytes: heap };
}

const [url, seconds] = process.argv.slice(2);
const browser = await startBrowser();
try {
  // A user's browser runs already: its start is not the page's.
  const first = await browser.newContext();
  await (await first.newPage()).goto(url);
  await first.close();
  const page = await browser.newPage({ viewport: { width: 1280, height: 800 } });
  console.log(JSON.stringify(await measure(page, url, Number(seconds))));
} finally {
  await browser.close();
}
