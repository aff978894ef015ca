// The findings of `mocapctl preflight`, which mocap-web makes with the same code.

export type Level = "good" | "look" | "bad";

export interface Finding {
  /** "camera north-east" */
  check: string;
  level: Level;
  what: string;
  /** A command or an action; empty: none is needed. */
  cure: string;
  /** The time that `what` names; null: none. */
  minutes: number | null;
}

/** For how many minutes of takes the disk has room; null: unknown. */
export const diskMinutes = (findings: Finding[] | null): number | null => findings?.find(({ check }) => check === "disk")?.minutes ?? null;

const levels: Record<string, Level> = { good: "good", warning: "look", bad: "bad" };

/** Leaves out what is not a finding. */
export function readFindings(said: unknown): Finding[] {
  if (!Array.isArray(said)) return [];
  return said.flatMap((each: Record<string, unknown> | null) => {
    const level = levels[String(each?.verdict)];
    return each && level ? [{ check: String(each.check ?? ""), level, what: String(each.what ?? ""), cure: String(each.cure ?? ""),
      minutes: typeof each.minutes === "number" ? each.minutes : null }] : [];
  });
}
