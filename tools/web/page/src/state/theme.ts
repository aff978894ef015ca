// Light or dark, by the system unless the operator chose; and whether the operator wants less motion.

import { computed, effect, signal } from "@preact/signals";
import { store, stored } from "./storage";

export type Theme = "system" | "light" | "dark";

const light = window.matchMedia("(prefers-color-scheme: light)");
const still = window.matchMedia("(prefers-reduced-motion: reduce)");
const systemIsLight = signal(light.matches);

const kept = stored("theme", "system");
export const theme = signal<Theme>(kept === "light" || kept === "dark" ? kept : "system");
export const shownTheme = computed(() => (theme.value === "system" ? (systemIsLight.value ? "light" : "dark") : theme.value));
export const reducedMotion = signal(still.matches);

export function startTheme(): void {
  light.addEventListener("change", () => (systemIsLight.value = light.matches));
  still.addEventListener("change", () => (reducedMotion.value = still.matches));
  effect(() => {
    document.documentElement.dataset.theme = shownTheme.value;
  });
  effect(() => store("theme", theme.value));
}
