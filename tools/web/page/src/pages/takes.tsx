import type { JSX } from "preact";
import { useState } from "preact/hooks";
import { EventKind } from "../../gen/mocap/v1/event_pb";
import { type TakeHealth, TakeQuality, TakeState } from "../../gen/mocap/v1/health_pb";
import { bytes, count, duration } from "../model/format";
import type { Level } from "../model/health_report";
import { readShots, writeShots } from "../model/shot_list";
import { LevelPill } from "../parts/level_mark";
import { Command, OrderButton, Panel } from "../parts/small";
import { eventCount, health, history, mayChange } from "../state/live";
import { activeTake, before_s, cancelTake, countdown_s, limit_s, markTake, nextTake, notes, slate, startTake, stopTake, takeBusy } from "../state/orders";
import { store, stored } from "../state/storage";

const stateText: Record<TakeState, string> = {
  [TakeState.UNSPECIFIED]: "recording", [TakeState.WAITING]: "waiting for its start", [TakeState.RECORDING]: "recording", [TakeState.ENDED]: "complete",
  [TakeState.FAILED]: "ended early", [TakeState.CANCELLED]: "deleted",
};

function quality(take: TakeHealth): { level: Level; text: string } {
  if (take.state === TakeState.FAILED || take.quality === TakeQuality.BAD) return { level: "bad", text: "bad" };
  return take.quality === TakeQuality.GOOD ? { level: "good", text: "good" } : { level: "look", text: "look" };
}

function Mark(): JSX.Element {
  const [text, setText] = useState("");
  const mark = () => void markTake(text.trim() || "mark").then((outcome) => outcome.good && setText(""));
  return (
    <form class="row" onSubmit={(event) => { event.preventDefault(); mark(); }}>
      <input class="input grow" aria-label="Text of the mark" placeholder="What happened?" maxLength={200} value={text} onInput={(event) => setText(event.currentTarget.value)} />
      <button class="button" type="submit" disabled={!mayChange.value}>Mark</button>
    </form>
  );
}

function Current({ take }: { take: TakeHealth | undefined }): JSX.Element {
  if (!take) return <Panel title="Take"><p class="soft">No take since the daemon started.</p></Panel>;
  const active = activeTake() !== null;
  const { level, text } = quality(take);
  const cancel = () => (window.confirm(`End the take ${take.name} and delete its file?`) ? cancelTake() : Promise.resolve());
  return (
    <Panel title={active ? "This take" : "Last take"} tools={<LevelPill level={level} text={`Quality: ${text}`} />}>
      <div class="stack">
        <p class="big-take"><strong>{take.name}</strong><span class="digits">{duration(take.seconds)}</span><span class="soft">{stateText[take.state] ?? "recording"}</span></p>
        {(take.message || take.reasons) && <p class={`answer ${level}`}><span>{take.message || take.reasons}</span></p>}
        <dl class="facts-small">
          <dt>Snapshots</dt><dd>{count(take.sets)}</dd><dt>Lost sets</dt><dd>{count(take.lostSets)}</dd>
          <dt>Lost images</dt><dd>{count(take.lostImages)}</dd><dt>Size</dt><dd>{bytes(take.sizeBytes)}</dd>
        </dl>
        {active && (
          <>
            <div class="row">
              <OrderButton primary text="Stop" disabled={!mayChange.value || takeBusy.value} run={stopTake} />
              <OrderButton text="Next take" disabled={!mayChange.value || takeBusy.value} run={nextTake} />
              <OrderButton text="Cancel and delete" disabled={!mayChange.value || takeBusy.value} run={cancel} />
            </div>
            <Mark />
          </>
        )}
        {!active && take.path && (
          <>
            <p class="faint">Quality figures, notes, rating and export are commands on the daemon's machine:</p>
            <Command text={`mocapctl take show ${take.path}`} />
            <Command text={`mocapctl take export ${take.path} --help`} />
          </>
        )}
      </div>
    </Panel>
  );
}

const seconds = (text: string): number => Math.max(0, Number(text) || 0);

function New(): JSX.Element {
  return (
    <Panel title="New take">
      <form class="stack" onSubmit={(event) => { event.preventDefault(); void startTake(); }}>
        <div class="fields">
          <label class="field"><span>Slate</span><input value={slate.value} placeholder="slate of the last take" maxLength={64} onInput={(event) => (slate.value = event.currentTarget.value)} /></label>
          <label class="field"><span>Countdown, s</span><input type="number" min="0" max="3600" step="any" value={countdown_s.value} onInput={(event) => (countdown_s.value = seconds(event.currentTarget.value))} /></label>
          <label class="field"><span>Begins earlier by, s</span><input type="number" min="0" max="600" step="any" value={before_s.value} onInput={(event) => (before_s.value = seconds(event.currentTarget.value))} /></label>
          <label class="field"><span>Ends after, s (0: at stop)</span><input type="number" min="0" max="86400" step="any" value={limit_s.value} onInput={(event) => (limit_s.value = seconds(event.currentTarget.value))} /></label>
        </div>
        <label class="field"><span>Notes</span><textarea rows={2} maxLength={1000} value={notes.value} onInput={(event) => (notes.value = event.currentTarget.value)} /></label>
        <button class="button primary" type="submit" disabled={!mayChange.value || takeBusy.value || activeTake() !== null}>Record</button>
      </form>
    </Panel>
  );
}

function ShotList(): JSX.Element {
  const [text, setText] = useState(stored("shots", ""));
  const [editing, setEditing] = useState(!text);
  const shots = readShots(text);
  const finish = () => {
    store("shots", writeShots(shots));
    setEditing(false);
  };
  const choose = (shot: (typeof shots)[number]) => {
    slate.value = shot.slate;
    notes.value = shot.notes;
  };
  return (
    <Panel title="Shot list" tools={<button class="button" type="button" onClick={editing ? finish : () => setEditing(true)}>{editing ? "Done" : "Edit"}</button>}>
      {editing && (
        <label class="field">
          <span>One shot a line, slate and notes, as pasted from a spreadsheet. Kept in this browser.</span>
          <textarea rows={6} value={text} onInput={(event) => setText(event.currentTarget.value)} />
        </label>
      )}
      {!editing && shots.length === 0 && <p class="soft">Empty.</p>}
      {!editing && shots.length > 0 && (
        <div class="table-box" tabIndex={0} role="region" aria-label="Shot list">
          <table>
            <thead><tr><th>Slate</th><th>Notes</th><th><span class="sr-only">Choose</span></th></tr></thead>
            <tbody>
              {shots.map((shot, i) => (
                <tr key={i} data-selected={shot.slate === slate.value}>
                  <th scope="row">{shot.slate}</th><td class="wide">{shot.notes}</td>
                  <td><button class="button" type="button" onClick={() => choose(shot)} aria-label={`Take ${shot.slate} next`}>Next</button></td>
                </tr>
              ))}
            </tbody>
          </table>
        </div>
      )}
    </Panel>
  );
}

const takeEvents = new Map<EventKind, { text: string; level: Level }>([
  [EventKind.TAKE_STARTED, { text: "started", level: "good" }], [EventKind.TAKE_ENDED, { text: "complete", level: "good" }],
  [EventKind.TAKE_FAILED, { text: "ended early", level: "bad" }],
]);

function Log(): JSX.Element {
  eventCount.value;
  const events = history.events.filter(({ event }) => takeEvents.has(event.kind));
  return (
    <Panel title="Takes since this page was opened">
      {events.length === 0 && <div class="stack"><p class="soft">None. All takes of the machine:</p><Command text="mocapctl take list" /></div>}
      {events.length > 0 && (
        <div class="table-box log" tabIndex={0} role="region" aria-label="Takes">
          <table>
            <thead><tr><th>Time</th><th>What</th><th>Take</th></tr></thead>
            <tbody>
              {events.map(({ at_s, event }) => {
                const { text, level } = takeEvents.get(event.kind)!;
                return (
                  <tr key={`${event.sequence}`}>
                    <td class="digits">{new Date(1000 * at_s).toLocaleTimeString("en-GB")}</td><td><LevelPill level={level} text={text} /></td><td class="wide">{event.message}</td>
                  </tr>
                );
              })}
            </tbody>
          </table>
        </div>
      )}
    </Panel>
  );
}

export function TakesPage(): JSX.Element {
  return (
    <div class="columns">
      <div class="stack">
        <Current take={health.value?.take} />
        <New />
      </div>
      <div class="stack">
        <ShotList />
        <Log />
      </div>
    </div>
  );
}
