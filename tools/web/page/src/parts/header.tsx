// On every page: record, time, health, latency, disk, and what this viewer missed.

import type { JSX } from "preact";
import { LatencyStage, TakeState } from "../../gen/mocap/v1/health_pb";
import { age, compact, count, duration, fixed, hoursOrMinutes, kUnknown } from "../model/format";
import { stage } from "../model/health_report";
import { diskMinutes } from "../model/preflight";
import { shownTime } from "../model/timecode";
import { reasonsShown } from "../state/keys";
import { dataAge, findings, health, light, mayChange, missed, now_ms, snapshot } from "../state/live";
import { activeTake, countdown_s, slate, startTake, stopTake, takeBusy } from "../state/orders";
import { LevelMark, levelText } from "./level_mark";

function Recorder(): JSX.Element {
  const take = activeTake();
  const waiting = take?.state === TakeState.WAITING;
  const text = !take ? "Record" : waiting ? "Waiting" : duration(take.seconds);
  const label = take ? `Stop the take ${take.name}` : "Record a take";
  return (
    <div class="recorder" role="group" aria-label="Recording">
      <button class={`button record ${take ? (waiting ? "waiting" : "running digits") : ""}`} type="button" aria-label={`${label}: ${text}`}
        title={mayChange.value ? `${label} (Shift R)` : "Needs a connection and the role operator"} disabled={!mayChange.value || takeBusy.value}
        onClick={() => void (take ? stopTake() : startTake())}>
        {text}
      </button>
      {take ? (
        <strong class="take-name" title={take.name}>{take.name}</strong>
      ) : (
        <>
          <input class="input" aria-label="Slate" placeholder="Slate" maxLength={64} value={slate.value}
            onInput={(event) => (slate.value = event.currentTarget.value)} />
          <select class="input" aria-label="Countdown before the take" title="Countdown" value={String(countdown_s.value)}
            onChange={(event) => (countdown_s.value = Number(event.currentTarget.value))}>
            {[0, 3, 5, 10].map((seconds) => <option key={seconds} value={String(seconds)}>{seconds === 0 ? "now" : `in ${seconds} s`}</option>)}
          </select>
        </>
      )}
    </div>
  );
}

function Fact({ name, value, hint, extra = "" }: { name: string; value: string; hint: string; extra?: string }): JSX.Element {
  return (
    <div class={`fact ${extra}`} title={hint}>
      <dt>{name}</dt>
      <dd>{value}</dd>
    </div>
  );
}

function Facts(): JSX.Element {
  const time = shownTime(snapshot.value);
  const total = stage(health.value, LatencyStage.TOTAL);
  const ms = (ns: bigint | undefined) => (ns === undefined ? kUnknown : fixed(Number(ns) / 1e6, 1));
  const disk = diskMinutes(findings.value);
  now_ms.value;
  return (
    <dl class="facts">
      <Fact name={time.source} value={time.text} hint="Time of the exposure that is shown" extra="time" />
      <Fact name="Age" value={age(dataAge.age_s(Date.now()))}
        hint={dataAge.clocksAgree ? "From the exposure until now" : "Since the exposure; the clocks of the two machines differ, so the network's shortest delay is not in it"} />
      <Fact name="p50/p99" value={`${ms(total?.p50Ns)}/${ms(total?.p99Ns)}\u2009ms`} hint="Latency, median and 99th percentile: from the exposure until the daemon sent the snapshot, over the last second" />
      <Fact name="Takes" value={health.value?.take ? count(health.value.take.takes) : kUnknown} hint="Takes since the daemon started" />
      <Fact name="Disk" value={disk === null ? kUnknown : hoursOrMinutes(disk)}
        hint={disk === null ? "Known after the first take, or with mocap-web --takes FOLDER" : "Room for takes of so long, at the rate of the last one"} />
      <Fact name="Missed" value={compact(missed.value)} hint="Snapshots that this browser did not draw because a newer one was there. The feed lost nothing" />
    </dl>
  );
}

export function Header(): JSX.Element {
  return (
    <header class="bar">
      <a class="brand" href="#/stage" aria-label="mocapd: stage"><img src="icon.svg" alt="" /><span>mocapd</span></a>
      <Recorder />
      <Facts />
      <button class="button light" type="button" aria-label={`Health: ${levelText[light.value]}. Show the reasons`} aria-haspopup="dialog"
        onClick={() => (reasonsShown.value = true)}>
        <LevelMark level={light.value} />
        {levelText[light.value]}
      </button>
    </header>
  );
}
