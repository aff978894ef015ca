import type { JSX } from "preact";
import { useState } from "preact/hooks";
import { type TakeHealth, TakeQuality, TakeState } from "../../gen/mocap/v1/health_pb";
import { bytes, count, duration } from "../model/format";
import type { Level } from "../model/health_report";
import { LevelPill } from "../parts/level_mark";
import { ShotList } from "../parts/shot_list";
import { OrderButton, Panel } from "../parts/small";
import { health, mayChange } from "../state/live";
import { TakeTable } from "../parts/take_table";
import { TakePage } from "./take";
import { addressOf, route } from "../state/route";
import { activeTake, before_s, cancelTake, countdown_s, limit_s, markTake, nextTake, notes, slate, startTake, stopTake, takeBusy } from "../state/orders";

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
        {!active && take.state !== TakeState.CANCELLED && <p><a href={addressOf("takes", take.name)}>Play, rate, export</a></p>}
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

export function TakesPage(): JSX.Element {
  const name = route.value.argument;
  if (name) return <TakePage name={name} />;
  return (
    <div class="stack">
      <div class="columns">
        <div class="stack">
          <Current take={health.value?.take} />
          <New />
        </div>
        <ShotList />
      </div>
      <TakeTable />
    </div>
  );
}
