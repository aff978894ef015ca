// A take in the picture of the volume, with play, pause and scrub.

import type { JSX } from "preact";
import { useEffect, useMemo } from "preact/hooks";
import { duration } from "../model/format";
import { shownTime } from "../model/timecode";
import { Playback } from "../state/playback";
import { useKeys } from "./hooks";
import { ScenePanel } from "./scene_panel";

const kJump_s = 1;

function Controls({ playback }: { playback: Playback }): JSX.Element {
  const at_s = playback.at_s.value;
  const where = `${duration(at_s)} of ${duration(playback.length_s)}`;
  return (
    <div class="player row" role="group" aria-label="Playback">
      <button class="button primary" type="button" onClick={() => playback.toggle()}>{playback.playing.value ? "Pause" : "Play"}</button>
      <button class="button" type="button" title="One frame back (,)" aria-label="−1 frame" onClick={() => playback.step(false)}>−1</button>
      <button class="button" type="button" title="One frame on (.)" aria-label="+1 frame" onClick={() => playback.step(true)}>+1</button>
      <input class="grow" type="range" min="0" max={playback.length_s} step="0.01" value={at_s} aria-label="Position in the take" aria-valuetext={where}
        onInput={(event) => playback.seek(Number(event.currentTarget.value))} />
      <span class="digits">{at_s.toFixed(2)} s<span class="soft"> / {duration(playback.length_s)}</span></span>
    </div>
  );
}

export function TakePlayer({ name, length_s }: { name: string; length_s: number }): JSX.Element {
  const playback = useMemo(() => new Playback(name, length_s), [name, length_s]);
  useEffect(() => () => playback.end(), [playback]);
  useKeys(() => [
    { key: "k", shown: "K", does: "Play or pause the take", run: () => playback.toggle() },
    { key: "j", shown: "J", does: "One second back in the take", run: () => playback.seek(playback.at_s.peek() - kJump_s) },
    { key: "l", shown: "L", does: "One second on in the take", run: () => playback.seek(playback.at_s.peek() + kJump_s) },
    { key: ",", shown: ",", does: "One frame back in the take", run: () => playback.step(false) },
    { key: ".", shown: ".", does: "One frame on in the take", run: () => playback.step(true) },
  ]);
  const time = shownTime(playback.snapshot.value);
  return (
    <section class="recorded" aria-label={`Take ${name}, not live`}>
      <p class="not-live"><strong>Take, not live</strong><span>{name}</span><span class="digits">{time.text} {time.source}</span>{playback.loading.value && <span class="soft">loading</span>}</p>
      {playback.fault.value && <p class="answer bad" role="alert"><span>{playback.fault.value}</span></p>}
      <ScenePanel source={playback} />
      <Controls playback={playback} />
    </section>
  );
}
