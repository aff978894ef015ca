// All takes of the machine.

import type { JSX } from "preact";
import { useEffect, useState } from "preact/hooks";
import { bytes, duration } from "../model/format";
import { slateText, startedText, takeQuality } from "../model/take_text";
import { health, open } from "../state/live";
import { listTakes, type TakeList, type TakeSummary } from "../state/recorded";
import { addressOf } from "../state/route";
import { LevelPill } from "./level_mark";
import { Command, Panel } from "./small";

function Row({ take }: { take: TakeSummary }): JSX.Element {
  const { level, text } = takeQuality(take.quality);
  return (
    <tr>
      <th scope="row"><a href={addressOf("takes", take.name)}>{take.name}</a></th>
      <td>{slateText(take.slate, take.number)}</td>
      <td class="digits">{startedText(take.started)}</td>
      <td class="number">{take.seconds === undefined ? "–" : duration(take.seconds)}</td>
      <td class="number">{take.bytes === undefined ? "–" : bytes(take.bytes)}</td>
      <td><LevelPill level={take.state === "complete" ? level : "look"} text={take.state === "complete" ? text : take.state} /></td>
      <td class="number">{take.rating ?? "–"}</td>
      <td class="wide">{take.notes}{take.tags && take.tags.length > 0 && <span class="soft"> {take.tags.join(", ")}</span>}</td>
    </tr>
  );
}

function Table({ takes }: { takes: TakeSummary[] }): JSX.Element {
  return (
    <div class="table-box" tabIndex={0} role="region" aria-label="All takes">
      <table>
        <thead>
          <tr><th>Take</th><th>Slate</th><th>Started</th><th class="number">Length</th><th class="number">Size</th><th>Quality</th><th class="number">Rating</th><th>Notes, tags</th></tr>
        </thead>
        <tbody>{takes.map((take) => <Row key={take.name} take={take} />)}</tbody>
      </table>
    </div>
  );
}

function contains(take: TakeSummary, wanted: string): boolean {
  return [take.name, take.slate, take.notes, ...(take.tags ?? [])].some((text) => text?.toLowerCase().includes(wanted));
}

export function TakeTable(): JSX.Element {
  const [list, setList] = useState<TakeList | null>(null);
  const [fault, setFault] = useState("");
  const [filter, setFilter] = useState("");
  const take = health.value?.take;
  useEffect(() => {
    listTakes().then((listed) => { setList(listed); setFault(""); }, (error) => setFault(String(error.message)));
  }, [open.value, take?.name, take?.state]);
  const wanted = filter.trim().toLowerCase();
  const shown = list?.takes.filter((each) => !wanted || contains(each, wanted)) ?? [];
  return (
    <Panel title="Takes" tools={<input class="input filter" type="search" aria-label="Filter the takes" placeholder="Filter" value={filter} onInput={(event) => setFilter(event.currentTarget.value)} />}>
      <div class="stack">
        {fault && <><p class="answer look"><span>{fault}</span></p><Command text="mocapctl take list" /></>}
        {list && !fault && shown.length === 0 && <p class="soft">{list.takes.length === 0 ? `No take in ${list.folder}.` : "No take fits the filter."}</p>}
        {shown.length > 0 && <Table takes={shown} />}
        {list && list.left_out > 0 && <p class="soft">{list.left_out} older takes are not listed; mocapctl take list lists all.</p>}
      </div>
    </Panel>
  );
}
