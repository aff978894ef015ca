import type { JSX } from "preact";
import { useMemo, useState } from "preact/hooks";
import { age } from "../model/format";
import { readFaults } from "../model/config_faults";
import { qrPath } from "../model/qr_path";
import { ReasonList } from "../parts/dialogs";
import { LevelPill, levelText } from "../parts/level_mark";
import { Command, OrderButton, OutcomeLine, Panel } from "../parts/small";
import { description, light, mayChange, server } from "../state/live";
import { type Outcome, order } from "../state/orders";
import { type Theme, theme } from "../state/theme";

function Faults({ outcome }: { outcome: Outcome }): JSX.Element {
  const faults = outcome.good ? [] : readFaults(outcome.message);
  if (faults.length === 0) return <OutcomeLine outcome={outcome} />;
  return (
    <div class="table-box" tabIndex={0} role="region" aria-label="Faults of the configuration">
      <table>
        <caption>The configuration has faults; nothing changed.</caption>
        <thead><tr><th>File</th><th class="number">Line</th><th class="number">Column</th><th>Fault</th></tr></thead>
        <tbody>
          {faults.map((fault, i) => (
            <tr key={i}><td><code>{fault.file}</code></td><td class="number">{fault.line}</td><td class="number">{fault.column}</td><td class="wide">{fault.text}</td></tr>
          ))}
        </tbody>
      </table>
    </div>
  );
}

function Configuration(): JSX.Element {
  const [outcome, setOutcome] = useState<Outcome | null>(null);
  return (
    <Panel title="Configuration">
      <div class="stack">
        <p class="soft">The daemon reads its files again. With faults it keeps its settings and the faults are listed here. Unchanged cameras, subjects and recordings go on; a change between replay and live cameras begins a new session.</p>
        <OrderButton primary text="Reload" disabled={!mayChange.value} run={async () => setOutcome(await order("reload", {}))} />
        {outcome && <Faults outcome={outcome} />}
        <p class="faint">Every value in force, with the file and line it comes from:</p>
        <Command text="sudo mocapctl config show" />
        <Command text="mocapd --check-config my.toml" />
      </div>
    </Panel>
  );
}

function Keys(): JSX.Element {
  const state = server.value;
  return (
    <Panel title="Connection, keys and roles">
      <div class="stack">
        <dl class="facts-small">
          <dt>Role of this browser</dt><dd>{state?.role ?? "unknown"}</dd>
          <dt>Feed</dt><dd>{state?.endpoint || "unknown"}</dd>
          <dt>mocap-web</dt><dd>{state?.version || "unknown"}</dd>
          <dt>mocapd</dt><dd>{description.value?.producer || "unknown"}</dd>
          <dt>Session</dt><dd>{description.value?.sessionId.slice(0, 8) || "unknown"}</dd>
          <dt>Last data at mocap-web</dt><dd>{age(state?.age_s)}</dd>
        </dl>
        <p class="soft">A viewer sees everything and changes nothing. Keys of programs that may connect to the feed:</p>
        <Command text="mocapctl keys list" />
      </div>
    </Panel>
  );
}

function Phone(): JSX.Element {
  const [token, setToken] = useState("");
  const local = ["localhost", "127.0.0.1", "[::1]"].includes(location.hostname);
  const address = `${location.origin}/${token.trim() && `?token=${encodeURIComponent(token.trim())}`}#/monitor`;
  const { path, size } = useMemo(() => qrPath(address), [address]);
  return (
    <Panel title="On a phone">
      <div class="stack">
        {local && <p class="answer look"><span>This address works on this machine only. Start mocap-web for the network, with TLS and a token, and open this page by the machine's name.</span></p>}
        <svg class="qr" viewBox={`0 0 ${size} ${size}`} shape-rendering="crispEdges" role="img" aria-label={`QR code of ${address}`}>
          <rect width={size} height={size} fill="#ffffff" />
          <path d={path} fill="#000000" />
        </svg>
        <label class="field"><span>Token for the phone, from mocap-web (empty: none)</span><input autoComplete="off" spellcheck={false} value={token} onInput={(event) => setToken(event.currentTarget.value)} /></label>
        <p class="faint">{address}</p>
      </div>
    </Panel>
  );
}

const themes: { value: Theme; text: string }[] = [{ value: "system", text: "As the system" }, { value: "light", text: "Light" }, { value: "dark", text: "Dark" }];

export function SetupPage(): JSX.Element {
  return (
    <div class="columns">
      <div class="stack">
        <Panel title="Doctor" tools={<LevelPill level={light.value} text={levelText[light.value]} />}>
          <div class="stack">
            <ReasonList />
            <p class="faint">Network cards, USB, permissions and buffers of the machine:</p>
            <Command text="mocapctl doctor" />
          </div>
        </Panel>
        <Configuration />
      </div>
      <div class="stack">
        <Keys />
        <Phone />
        <Panel title="This browser">
          <fieldset class="row">
            <legend class="sr-only">Colours</legend>
            {themes.map(({ value, text }) => (
              <label key={value} class="check"><input type="radio" name="theme" checked={theme.value === value} onChange={() => (theme.value = value)} />{text}</label>
            ))}
          </fieldset>
        </Panel>
      </div>
    </div>
  );
}
