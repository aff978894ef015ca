// Whether the daemon is ready to record: every check, and what mends a fault.

import type { JSX } from "preact";
import { worst } from "../model/health_report";
import { findings } from "../state/live";
import { checking, checkNow } from "../state/preflight";
import { LevelMark, LevelPill, levelText } from "./level_mark";
import { Panel } from "./small";

export function Preflight(): JSX.Element {
  const found = findings.value ?? [];
  const level = worst(found);
  const tools = (
    <>
      {found.length > 0 && <LevelPill level={level} text={levelText[level]} />}
      <button class="button" type="button" disabled={checking.value} onClick={() => void checkNow()}>{checking.value ? "Checking…" : "Check now"}</button>
    </>
  );
  return (
    <Panel title="Ready to record?" tools={tools}>
      {found.length === 0 && <p class="soft">The first check is under way.</p>}
      <ul class="reasons">
        {found.map((finding) => (
          <li key={finding.check}>
            <LevelMark level={finding.level} />
            <span><strong>{finding.check}</strong> {finding.what}</span>
            {finding.cure && <span class="remedy">{finding.cure}</span>}
          </li>
        ))}
      </ul>
    </Panel>
  );
}
