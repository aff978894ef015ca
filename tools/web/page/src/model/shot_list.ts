// The shot list as text, one shot a line, as pasted from a spreadsheet: name, slate, notes, seconds.

import type { Shot } from "../../gen/mocap/v1/control_pb";

export type ShotLine = Pick<Shot, "name" | "slate" | "notes" | "seconds" | "done">;

// The bound of the daemon; it refuses a longer list with the reason.
const kMaxShots = 500;

/**
 * One shot for each line with a name. Columns end with a tab, or with a semicolon or comma if the line has no tab. A shot of `before`
 * that was taken stays taken.
 */
export function readShots(text: string, before: readonly ShotLine[] = []): ShotLine[] {
  const done = new Set(before.filter((shot) => shot.done).map((shot) => shot.name));
  const shots: ShotLine[] = [];
  for (const line of text.split(/\r?\n/)) {
    const [name = "", slate = "", notes = "", seconds = ""] = line.split(line.includes("\t") ? "\t" : /[;,]/).map((column) => column.trim());
    if (name) shots.push({ name, slate, notes, seconds: Math.max(0, Number(seconds) || 0), done: done.has(name) });
  }
  return shots.slice(0, kMaxShots);
}

export const writeShots = (shots: readonly ShotLine[]): string =>
  shots.map(({ name, slate, notes, seconds }) => [name, slate, notes, seconds || ""].join("\t").trimEnd()).join("\n");
