// Good, look, bad: a shape as well as a colour.

import type { JSX } from "preact";
import type { Level } from "../model/health_report";

export const levelText: Record<Level, string> = { good: "Good", look: "Look", bad: "Bad" };

export function LevelMark({ level }: { level: Level }): JSX.Element {
  return (
    <svg class={`mark ${level}`} viewBox="0 0 16 16" aria-hidden="true">
      {level === "good" && <circle cx="8" cy="8" r="6" fill="currentColor" />}
      {level === "look" && <path d="M8 1.5 15 14.5H1z" fill="currentColor" />}
      {level === "bad" && <path d="M1.5 5 5 1.5h6L14.5 5v6L11 14.5H5L1.5 11z" fill="currentColor" />}
    </svg>
  );
}

export function LevelPill({ level, text }: { level: Level; text: string }): JSX.Element {
  return (
    <span class={`pill ${level}`}>
      <LevelMark level={level} />
      {text}
    </span>
  );
}
