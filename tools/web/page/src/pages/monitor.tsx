// Read-only, for a director's screen or a phone.

import type { JSX } from "preact";
import { TakeState } from "../../gen/mocap/v1/health_pb";
import { duration, fixed } from "../model/format";
import { phaseText, measuredMarkers } from "../model/summary";
import { shownTime } from "../model/timecode";
import { LevelPill, levelText } from "../parts/level_mark";
import { ScenePanel } from "../parts/scene_panel";
import { Swatch, stateOf, subjectLevel } from "../parts/subject_card";
import { description, health, light, reasons, snapshot } from "../state/live";
import { activeTake } from "../state/orders";

function Headline(): JSX.Element {
  const take = activeTake();
  const last = health.value?.take;
  const time = shownTime(snapshot.value);
  const recording = take?.state === TakeState.RECORDING;
  return (
    <header class="headline">
      <div>
        <span class={`tally ${recording ? "running" : ""}`}>{recording ? "REC" : take ? "WAIT" : "STBY"}</span>
        {take && <span class="clock digits">{duration(take.seconds)}</span>}
      </div>
      <div class="slate">{take?.name ?? last?.name ?? "no take yet"}</div>
      <div><span class="clock digits">{time.text}</span><span class="faint">{time.source}</span></div>
    </header>
  );
}

export function MonitorPage(): JSX.Element {
  const subjects = description.value?.subjects ?? [];
  return (
    <div class="monitor">
      <Headline />
      <ScenePanel plain />
      <div class="stack">
        <div class="people">
          {subjects.map((subject, index) => {
            const state = stateOf(index);
            return (
              <div key={subject.name} class="panel person">
                <Swatch index={index} />
                <strong>{subject.name}</strong>
                <span class="digits soft">{measuredMarkers(state)}/{subject.markers.length}</span>
                <LevelPill level={subjectLevel(state?.phase)} text={phaseText(state?.phase)} />
              </div>
            );
          })}
        </div>
        <footer class="foot">
          <LevelPill level={light.value} text={levelText[light.value]} />
          <span>{reasons.value[0]?.text ?? `${fixed(health.value?.setRateHz, 1)} sets a second`}</span>
          <a href="#/stage">Stage</a>
        </footer>
      </div>
    </div>
  );
}
