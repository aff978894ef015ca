import type { JSX } from "preact";
import { CameraTile } from "../parts/camera_tile";
import { useCameras } from "../parts/hooks";
import { ScenePanel } from "../parts/scene_panel";
import { Panel, Toggle } from "../parts/small";
import { SubjectCard, stateOf } from "../parts/subject_card";
import { fixed } from "../model/format";
import { phaseText, sceneSummary } from "../model/summary";
import { description, snapshot } from "../state/live";
import { raysInWords, stripImages } from "../state/stage_options";

/** What the picture shows, as text and as a table. */
function InWords(): JSX.Element {
  const subjects = description.value?.subjects ?? [];
  return (
    <details class="panel details">
      <summary>What the picture shows, in words and numbers</summary>
      <p>{sceneSummary(description.value, snapshot.value)}</p>
      {raysInWords.value && <p>{raysInWords.value}</p>}
      <div class="table-box" tabIndex={0} role="region" aria-label="Position of each subject">
        <table>
          <thead><tr><th>Subject</th><th>State</th><th class="number">Forward x</th><th class="number">Left y</th><th class="number">Up z</th></tr></thead>
          <tbody>
            {subjects.map((subject, index) => {
              const state = stateOf(index);
              const root = state?.bones?.worldPositionsM ?? [];
              return (
                <tr key={subject.name}>
                  <th scope="row">{subject.name}</th><td>{phaseText(state?.phase)}</td>
                  {[0, 1, 2].map((axis) => <td key={axis} class="number">{fixed(root[axis], 2, "m")}</td>)}
                </tr>
              );
            })}
          </tbody>
        </table>
      </div>
    </details>
  );
}

export function StagePage(): JSX.Element {
  const cameras = useCameras();
  const subjects = description.value?.subjects ?? [];
  return (
    <>
      <div class="stage">
        <ScenePanel />
        <Panel title="Subjects">
          {subjects.length === 0 && <p class="soft">No subject is configured. Add one on the page <a href="#/subjects">Subjects</a>.</p>}
          {subjects.map((subject, index) => <SubjectCard key={subject.name} subject={subject} index={index} />)}
        </Panel>
      </div>
      <div class="row">
        <h2>Cameras</h2>
        <span class="push"><Toggle text="Images" hint="Previews of the cameras; they cost the daemon a little time" on={stripImages.value} set={(on) => (stripImages.value = on)} /></span>
      </div>
      <section class="strip" aria-label="Cameras" tabIndex={0}>
        {cameras.map((camera, index) => <CameraTile key={camera.name} camera={camera} index={index} images={stripImages.value} />)}
      </section>
      <InWords />
    </>
  );
}
