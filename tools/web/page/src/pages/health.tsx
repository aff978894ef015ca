import type { JSX } from "preact";
import { useMemo, useState } from "preact/hooks";
import { type Health, LatencyStage } from "../../gen/mocap/v1/health_pb";
import { eventKind, eventText } from "../model/event_text";
import { bytes, count, fixed, kUnknown, milliseconds } from "../model/format";
import { stage } from "../model/health_report";
import { kStages } from "../model/history";
import { latencyHistogram } from "../model/latency_histogram";
import { Preflight } from "../parts/preflight";
import { ReasonList } from "../parts/dialogs";
import { Graph } from "../parts/graph";
import { Histogram } from "../parts/histogram";
import { LevelMark, LevelPill, levelText } from "../parts/level_mark";
import { Panel } from "../parts/small";
import { description, eventCount, health, history, light, missed } from "../state/live";

const stageNames = new Map<LatencyStage, string>([
  [LatencyStage.RECEIVE, "Receive"], [LatencyStage.DETECT, "Detect"], [LatencyStage.FUSE, "Fuse"], [LatencyStage.SEND, "Send"], [LatencyStage.TOTAL, "Total"],
]);

function Stages({ known }: { known: Health }): JSX.Element {
  return (
    <div class="table-box" tabIndex={0} role="region" aria-label="Latency of each stage">
      <table>
        <caption>Over the last second, from the middle of the exposure.</caption>
        <thead><tr><th>Stage</th><th class="number">p50</th><th class="number">p99</th><th class="number">Max</th><th class="number">Sets</th></tr></thead>
        <tbody>
          {[...kStages, LatencyStage.TOTAL].map((which) => {
            const latency = stage(known, which);
            return (
              <tr key={which}>
                <th scope="row">{stageNames.get(which)}</th><td class="number">{milliseconds(latency?.p50Ns, 2)}</td><td class="number">{milliseconds(latency?.p99Ns, 2)}</td>
                <td class="number">{milliseconds(latency?.maxNs, 2)}</td><td class="number">{count(latency?.count)}</td>
              </tr>
            );
          })}
        </tbody>
      </table>
    </div>
  );
}

function Latency({ known }: { known: Health }): JSX.Element {
  const samples = useMemo(() => history.samples(), [known]);
  return (
    <Panel title="Latency">
      <div class="stack">
        <Graph label="Total latency of the last minutes, median and 99th percentile" unit="ms" at_s={samples.at_s}
          lines={[{ label: "p50", values: samples.p50_ms }, { label: "p99", values: samples.p99_ms, dashed: true }]} />
        <Stages known={known} />
        <details class="details">
          <summary>p99 of each stage over the last minutes</summary>
          <Graph label="99th percentile of each stage over the last minutes" unit="ms" at_s={samples.at_s}
            lines={kStages.map((which) => ({ label: stageNames.get(which) ?? "", values: samples.p99ByStage_ms.get(which) ?? [] }))} />
        </details>
      </div>
    </Panel>
  );
}

function Histograms({ known }: { known: Health }): JSX.Element | null {
  const [which, setWhich] = useState(LatencyStage.TOTAL);
  const buckets = latencyHistogram(known, history.before(), which);
  if (known.latencyTotals.length === 0) return null;
  return (
    <Panel title="Latency of the last minute" tools={(
      <select class="input filter" aria-label="Stage" value={String(which)} onChange={(event) => setWhich(Number(event.currentTarget.value))}>
        {[LatencyStage.TOTAL, ...kStages].map((each) => <option key={each} value={String(each)}>{stageNames.get(each)}</option>)}
      </select>
    )}>
      {buckets.length > 0 ? <Histogram buckets={buckets} label={`Latency of ${stageNames.get(which)}: share of the sets by upper end`} /> : <p class="soft">Nothing measured yet.</p>}
    </Panel>
  );
}

function Rate({ known }: { known: Health }): JSX.Element {
  const samples = useMemo(() => history.samples(), [known]);
  const figures: [string, string][] = [
    ["Sets", count(known.sets)], ["Complete sets", known.sets > 0n ? `${((100 * Number(known.completeSets)) / Number(known.sets)).toFixed(2)}\u2009%` : kUnknown],
    ["Skipped by fusion", count(known.passedOverSets)], ["Dropped before publishing", count(known.droppedSnapshots)],
    ["Skipped by the publisher", count(known.passedOverSnapshots)], ["Sent", count(known.sentSnapshots)], ["Missed by this page", count(missed.value)],
  ];
  return (
    <Panel title="Sets and queues">
      <div class="stack">
        <Graph label="Frame sets a second over the last minutes" unit="Hz" at_s={samples.at_s} lines={[{ label: "sets a second", values: samples.rate_hz }]} />
        <dl class="facts-small">{figures.map(([name, value]) => [<dt key={name}>{name}</dt>, <dd key={`${name}-value`}>{value}</dd>])}</dl>
      </div>
    </Panel>
  );
}

function Subscribers({ known }: { known: Health }): JSX.Element {
  const feed = known.feed;
  const figures: [string, string][] = feed
    ? [["Connected now", count(feed.listeners)], ["Do not keep up now", count(feed.behind)], ["Subscriptions now", count(feed.subscriptions)],
      ["Connections", count(feed.connections)], ["Disconnections", count(feed.disconnections)], ["Failed handshakes", count(feed.failedHandshakes)],
      ["Refused: key", count(feed.refusedClients)], ["Cut off", count(feed.cutOff)], ["No file descriptor", count(feed.failedAccepts)]]
    : [];
  return (
    <Panel title="Subscribers of the feed">
      {!feed && <p class="soft">Unknown: a recording has no subscribers.</p>}
      <dl class="facts-small">{figures.map(([name, value]) => [<dt key={name}>{name}</dt>, <dd key={`${name}-value`}>{value}</dd>])}</dl>
    </Panel>
  );
}

function Clocks({ known }: { known: Health }): JSX.Element {
  return (
    <Panel title="Clocks">
      <div class="table-box" tabIndex={0} role="region" aria-label="Clocks of the cameras">
        <table>
          <thead><tr><th>Camera</th><th class="number">Offset</th><th class="number">Drift</th><th class="number">Jitter</th><th class="number">Uncertainty</th><th class="number">Leaps</th></tr></thead>
          <tbody>
            {known.cameras.map((camera) => (
              <tr key={camera.name}>
                <th scope="row">{camera.name}</th><td class="number">{fixed(camera.offsetUs, 1, "µs")}</td><td class="number">{fixed(camera.driftUsS, 2, "µs/s")}</td>
                <td class="number">{fixed(camera.jitterUs, 1, "µs")}</td><td class="number">{fixed(camera.clockUncertaintyUs || null, 1, "µs")}</td><td class="number">{count(camera.clockLeaps)}</td>
              </tr>
            ))}
          </tbody>
        </table>
      </div>
    </Panel>
  );
}

function Recordings({ known }: { known: Health }): JSX.Element | null {
  if (known.recordings.length === 0) return null;
  return (
    <Panel title="Recordings">
      <ul class="reasons">
        {known.recordings.map((recording) => (
          <li key={recording.path}><LevelMark level={recording.error ? "bad" : "good"} /><span>{recording.path}, {bytes(recording.sizeBytes)}, {count(recording.records)} records{recording.error && `: ${recording.error}`}</span></li>
        ))}
      </ul>
    </Panel>
  );
}

function Events(): JSX.Element {
  const [filter, setFilter] = useState("");
  eventCount.value;
  const wanted = filter.trim().toLowerCase();
  const shown = history.events.filter(({ event }) => !wanted || `${eventKind(event).text} ${eventText(event, description.value)}`.toLowerCase().includes(wanted));
  return (
    <Panel title="Events" tools={<input class="input filter" type="search" aria-label="Filter the events" placeholder="Filter" value={filter} onInput={(event) => setFilter(event.currentTarget.value)} />}>
      {shown.length === 0 && <p class="soft">{history.events.length === 0 ? "None since this page was opened." : "None fits the filter."}</p>}
      {shown.length > 0 && (
        <div class="table-box log" tabIndex={0} role="region" aria-label="Events">
          <table>
            <thead><tr><th>Time</th><th>What</th><th>Details</th></tr></thead>
            <tbody>
              {shown.map(({ at_s, event }) => {
                const { text, level } = eventKind(event);
                return <tr key={`${event.sequence}`}><td class="digits">{new Date(1000 * at_s).toLocaleTimeString("en-GB")}</td><td><LevelPill level={level} text={text} /></td><td class="wide">{eventText(event, description.value)}</td></tr>;
              })}
            </tbody>
          </table>
        </div>
      )}
    </Panel>
  );
}

export function HealthPage(): JSX.Element {
  const known = health.value;
  return (
    <div class="columns">
      <div class="stack">
        <Panel title="Now" tools={<LevelPill level={light.value} text={levelText[light.value]} />}><ReasonList /></Panel>
        <Preflight />
        {known && <Latency known={known} />}
        {known && <Histograms known={known} />}
        {known && <Rate known={known} />}
      </div>
      <div class="stack">
        <Events />
        {known && <Subscribers known={known} />}
        {known && <Clocks known={known} />}
        {known && <Recordings known={known} />}
      </div>
    </div>
  );
}
