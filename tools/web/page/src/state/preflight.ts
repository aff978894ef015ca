// Checks the daemon again and again while the page is visible.

import { effect, signal } from "@preact/signals";
import { readFindings } from "../model/preflight";
import { eventCount, findings, open } from "./live";
import { readPreflight } from "./recorded";

// A check takes the server 2.2 s.
const kPeriod_ms = 8000;

export const checking = signal(false);

export async function checkNow(): Promise<void> {
  if (checking.peek() || document.hidden || !open.peek()) return;
  checking.value = true;
  try {
    findings.value = readFindings(await readPreflight());
  } catch (error) {
    findings.value = [{ check: "preflight", level: "look", what: error instanceof Error ? error.message : String(error), cure: "", minutes: null }];
  }
  checking.value = false;
}

/** Called once. An event of the daemon begins a check at once. */
export function startPreflight(): void {
  window.setInterval(() => void checkNow(), kPeriod_ms);
  effect(() => {
    eventCount.value;
    if (open.value) void checkNow();
    else findings.value = null;
  });
}
