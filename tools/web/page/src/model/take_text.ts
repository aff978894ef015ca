// Words about a recorded take.

import type { Level } from "./health_report";

/** The level and word of a take's quality; the daemon gives "good", "look" or "bad". */
export function takeQuality(quality: string | undefined): { level: Level; text: string } {
  if (quality === "good" || quality === "bad") return { level: quality, text: quality };
  return { level: "look", text: quality || "not judged" };
}

/** "walk 3", "walk", or a dash. */
export function slateText(slate: string | undefined, number: number | undefined): string {
  return [slate, number || ""].filter(Boolean).join(" ") || "–";
}

/** "2026-03-01 12:00:05" in the time zone of the browser; empty: unknown. */
export function startedText(utc: string | undefined): string {
  const at = utc ? new Date(utc.replace(/(\.\d{3})\d+Z$/, "$1Z")) : null;
  return at && !Number.isNaN(at.getTime()) ? at.toLocaleString("sv-SE") : "";
}

export const readTags = (text: string): string[] => text.split(",").map((tag) => tag.trim()).filter(Boolean);
