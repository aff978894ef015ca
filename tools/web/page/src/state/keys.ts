// The keyboard. The help lists the same table that the keys use, so that it cannot be wrong.

import { signal } from "@preact/signals";
import { mayChange } from "./live";
import { activeTake, markTake, nextTake, startTake, stopTake, takeBusy } from "./orders";
import { addressOf, kPages } from "./route";
import { shownTheme, theme } from "./theme";

export interface Key {
  /** As KeyboardEvent.key says it. */
  key: string;
  shown: string;
  does: string;
  run(): void;
}

export const helpShown = signal(false);
export const reasonsShown = signal(false);

const pageKeys: Key[] = kPages.map((page, i) => ({
  key: String(i + 1), shown: String(i + 1), does: `Page ${page}`,
  run: () => (location.hash = addressOf(page)),
}));

const permitted = (run: () => void) => () => {
  if (mayChange.peek() && !takeBusy.peek()) run();
};

const fixedKeys: Key[] = [
  { key: "?", shown: "?", does: "This list", run: () => (helpShown.value = !helpShown.peek()) },
  { key: "h", shown: "H", does: "Reasons of the health light", run: () => (reasonsShown.value = !reasonsShown.peek()) },
  { key: "R", shown: "Shift R", does: "Record, or stop the take", run: permitted(() => void (activeTake() ? stopTake() : startTake())) },
  { key: "N", shown: "Shift N", does: "End the take and start the next one", run: permitted(() => void nextTake()) },
  { key: "m", shown: "M", does: "Mark this instant in the take", run: permitted(() => void (activeTake() && markTake("mark"))) },
  { key: "d", shown: "D", does: "Dark or light", run: () => (theme.value = shownTheme.peek() === "dark" ? "light" : "dark") },
];

/** Keys of the parts that are shown. */
const partKeys = signal<Key[]>([]);

/** Returns the function that removes the keys. */
export function addKeys(keys: Key[]): () => void {
  partKeys.value = [...partKeys.peek(), ...keys];
  return () => (partKeys.value = partKeys.peek().filter((key) => !keys.includes(key)));
}

export const allKeys = (): Key[] => [...fixedKeys, ...pageKeys, ...partKeys.value];

const takesText = (target: EventTarget | null): boolean =>
  target instanceof HTMLElement && (target.isContentEditable || ["INPUT", "TEXTAREA", "SELECT"].includes(target.tagName));

export function startKeys(): void {
  window.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || event.repeat || takesText(event.target)) return;
    const found = allKeys().find((key) => key.key === event.key);
    if (!found) return;
    event.preventDefault();
    found.run();
  });
}
