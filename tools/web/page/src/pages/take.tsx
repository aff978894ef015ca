// One recorded take: played, described, changed.

import type { JSX } from "preact";
import { useEffect, useState } from "preact/hooks";
import { bytes, count, duration, fixed } from "../model/format";
import { readTags, slateText, startedText, takeQuality } from "../model/take_text";
import { LevelPill } from "../parts/level_mark";
import { OrderButton, Panel } from "../parts/small";
import { TakeFiles } from "../parts/take_files";
import { TakePlayer } from "../parts/take_player";
import { changeTake, mayChangeTakes, showTake, type TakeDetails } from "../state/recorded";
import { say } from "../state/toasts";

function Quality({ take }: { take: TakeDetails }): JSX.Element {
  const figures = take.report.quality;
  const { level, text } = takeQuality(take.quality || figures.quality);
  const facts: [string, string][] = [
    ["Length", take.seconds === undefined ? "–" : duration(take.seconds)], ["Size", take.bytes === undefined ? "–" : bytes(take.bytes)], ["Sets", count(figures.sets)],
    ["Lost sets", count(figures.lost_sets)], ["Lost images", count(figures.lost_images)], ["Residual", fixed(figures.residual_px, 2, "px")],
    ["Longest gap", fixed(figures.longest_gap_s, 2, "s")], ["Started", startedText(take.started) || "–"],
  ];
  return (
    <Panel title={slateText(take.slate, take.number)} tools={<LevelPill level={level} text={`Quality: ${text}`} />}>
      <div class="stack">
        {take.state !== "complete" && <p class="answer look"><span>The take {take.state === "is being recorded" ? take.state : `is ${take.state}`}.</span></p>}
        {take.reasons && <p class="answer look"><span>{take.reasons}</span></p>}
        {take.report.damages.map((damage) => <p key={damage} class="answer bad"><span>{damage}</span></p>)}
        <dl class="facts-small">{facts.map(([name, value]) => [<dt key={name}>{name}</dt>, <dd key={`${name}-value`}>{value}</dd>])}</dl>
        {(figures.subjects ?? []).map((subject) => (
          <p key={subject.name}><strong>{subject.name}</strong> <span class="soft">tracked {fixed(subject.tracked, 1, "%")}, {count(subject.label_changes)} label changes, residual {fixed(subject.residual_mm, 1, "mm")}</span></p>
        ))}
      </div>
    </Panel>
  );
}

function Notes({ take, changed }: { take: TakeDetails; changed(): void }): JSX.Element {
  const [notes, setNotes] = useState(take.notes ?? "");
  const [tags, setTags] = useState((take.tags ?? []).join(", "));
  const [rating, setRating] = useState(take.rating === null || take.rating === undefined ? "" : String(take.rating));
  const keep = async () => {
    const outcome = await changeTake(take.name, "edit", { notes, tags: readTags(tags), ...(rating && { rating: Number(rating) }) });
    say(outcome.message, outcome.good);
    if (outcome.good) changed();
  };
  return (
    <Panel title="Notes">
      <div class="stack">
        <label class="field"><span>Notes</span><textarea rows={3} maxLength={4000} value={notes} onInput={(event) => setNotes(event.currentTarget.value)} /></label>
        <div class="fields">
          <label class="field"><span>Tags, with commas between</span><input value={tags} maxLength={1000} onInput={(event) => setTags(event.currentTarget.value)} /></label>
          <label class="field"><span>Rating, 5 is the best</span>
            <select class="input" value={rating} onChange={(event) => setRating(event.currentTarget.value)}>
              {!rating && <option value="">none</option>}
              {[0, 1, 2, 3, 4, 5].map((each) => <option key={each} value={String(each)}>{each}</option>)}
            </select>
          </label>
        </div>
        <OrderButton primary text="Keep" disabled={!mayChangeTakes.value} run={keep} />
      </div>
    </Panel>
  );
}

export function TakePage({ name }: { name: string }): JSX.Element {
  const [take, setTake] = useState<TakeDetails | null>(null);
  const [fault, setFault] = useState("");
  const read = () => {
    showTake(name).then((shown) => { setTake(shown); setFault(""); }, (error) => setFault(String(error.message)));
  };
  useEffect(() => {
    setTake(null);
    read();
  }, [name]);
  return (
    <div class="stack">
      <p><a href="#/takes">All takes</a></p>
      {fault && <p class="answer bad" role="alert"><span>{fault}</span></p>}
      {!take && !fault && <p class="soft">Reading the take.</p>}
      {take && take.seconds !== undefined && <TakePlayer key={take.name} name={take.name} length_s={take.seconds} />}
      {take && (
        <div class="columns">
          <div class="stack"><Quality take={take} /><TakeFiles name={take.name} /></div>
          <Notes key={take.name} take={take} changed={read} />
        </div>
      )}
    </div>
  );
}
