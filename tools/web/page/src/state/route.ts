// The page in the address: #/cameras/north-east is the page "cameras" with the argument "north-east".

import { signal } from "@preact/signals";

export const kPages = ["stage", "cameras", "subjects", "calibrate", "takes", "health", "setup", "monitor"] as const;
export type PageName = (typeof kPages)[number];

export interface Route {
  page: PageName;
  argument: string;
}

/** An unknown page is the stage. */
export function readRoute(hash: string): Route {
  const [page = "", argument = ""] = hash.replace(/^#\/?/, "").split("/");
  const known = kPages.find((name) => name === page);
  let name = argument;
  try {
    name = decodeURIComponent(argument);
  } catch {
    // A broken escape stays as it is.
  }
  return known ? { page: known, argument: name } : { page: "stage", argument: "" };
}

export const addressOf = (page: PageName, argument = ""): string => `#/${page}${argument && `/${encodeURIComponent(argument)}`}`;

export const route = signal<Route>(readRoute(location.hash));

/** The page shows a recorded take. */
export const isTake = (): boolean => route.value.page === "takes" && route.value.argument !== "";

export function startRoute(): void {
  window.addEventListener("hashchange", () => (route.value = readRoute(location.hash)));
}
