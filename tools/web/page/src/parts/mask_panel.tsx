// Drawing, removing, learning and undoing the masks of a camera.

import type { JSX } from "preact";
import { useEffect, useState } from "preact/hooks";
import { type Masks, type Polygon, describePolygon, rectangle, samePolygons } from "../model/masks";
import { description, mayChange, open } from "../state/live";
import { drawMasks, forgetMasks, learnMasks, listMasks, undoMasks } from "../state/masks";
import type { Outcome } from "../state/orders";
import type { MaskTool } from "./mask_overlay";
import { OrderButton, OutcomeLine, Panel, Toggle } from "./small";

export interface MaskDraft {
  /** Of the daemon; null: unknown. */
  inForce: Masks | null;
  /** The drawn masks as the operator wants them. */
  drawn: Polygon[];
  changed: boolean;
  tool: MaskTool | null;
  marked: number | null;
  outcome: Outcome | null;
  setDrawn(drawn: Polygon[]): void;
  add(polygon: Polygon): void;
  setTool(tool: MaskTool | null): void;
  setMarked(marked: number | null): void;
  /** Executes an order about masks and reads them again. */
  run(ask: () => Promise<Outcome>): Promise<void>;
}

/** Reads the masks when the page opens and when the description changes: another operator may have changed them. */
export function useMaskDraft(camera: string): MaskDraft {
  const [inForce, setInForce] = useState<Masks | null>(null);
  const [wanted, setWanted] = useState<Polygon[] | null>(null);
  const [tool, setTool] = useState<MaskTool | null>(null);
  const [marked, setMarked] = useState<number | null>(null);
  const [outcome, setOutcome] = useState<Outcome | null>(null);
  const read = () => listMasks(camera).then(setInForce, () => setInForce(null));
  const version = description.value?.version;
  useEffect(() => {
    if (open.value) void read();
  }, [camera, version, open.value]);
  const drawn = wanted ?? inForce?.drawn ?? [];
  const add = (polygon: Polygon) => setWanted((before) => [...(before ?? inForce?.drawn ?? []), polygon]);
  const run = async (ask: () => Promise<Outcome>) => {
    const done = await ask();
    setOutcome(done);
    if (!done.good) return;
    await read();
    setWanted(null);
    setTool(null);
  };
  return { inForce, drawn, changed: wanted !== null && !samePolygons(wanted, inForce?.drawn ?? []), tool, marked, outcome, setDrawn: setWanted, add, setTool, setMarked, run };
}

function List({ draft }: { draft: MaskDraft }): JSX.Element {
  const { drawn, setMarked, setDrawn } = draft;
  return (
    <ol class="mask-list" aria-label="Drawn masks">
      {drawn.map((polygon, i) => (
        <li key={i} onPointerEnter={() => setMarked(i)} onPointerLeave={() => setMarked(null)}>
          <span>{i + 1}: {describePolygon(polygon)}</span>
          <button class="button" type="button" disabled={!mayChange.value} aria-label={`Remove mask ${i + 1}`} onFocus={() => setMarked(i)} onBlur={() => setMarked(null)}
            onClick={() => {
              setMarked(null);
              setDrawn(drawn.filter((_polygon, k) => k !== i));
            }}>Remove</button>
        </li>
      ))}
    </ol>
  );
}

const kFields = ["Left", "Top", "Width", "Height"] as const;

/** A rectangle without a pointer. */
function ByNumbers({ draft }: { draft: MaskDraft }): JSX.Element {
  const [values, setValues] = useState(["", "", "", ""]);
  const add = () => {
    const [x, y, width, height] = values.map(Number);
    draft.add(rectangle(x, y, width, height));
    setValues(["", "", "", ""]);
  };
  return (
    <details class="details">
      <summary>Rectangle by numbers</summary>
      <form class="stack" onSubmit={(event) => { event.preventDefault(); add(); }}>
        <div class="fields four">
          {kFields.map((name, i) => (
            <label key={name} class="field"><span>{name}, px</span><input type="number" required step="1" min={i < 2 ? undefined : 1} value={values[i]}
              onInput={(event) => setValues(values.map((value, k) => (k === i ? event.currentTarget.value : value)))} /></label>
          ))}
        </div>
        <button class="button" type="submit" disabled={!mayChange.value}>Add the rectangle</button>
      </form>
    </details>
  );
}

const kHints: Record<MaskTool, string> = {
  rectangle: "Drag over the picture.", polygon: "Click the corners; click the first one, or press Enter, to close. Esc drops it.",
};

/** What is needed beside the picture: on a phone the panel is far below it. */
export function MaskTools({ camera, draft }: { camera: string; draft: MaskDraft }): JSX.Element {
  const { inForce, drawn, changed, tool, setTool, setDrawn, run } = draft;
  const choose = (chosen: MaskTool) => (on: boolean) => setTool(on && mayChange.value ? chosen : null);
  return (
    <div class="stack" role="group" aria-label="Draw masks">
      <div class="row">
        <Toggle text="Mask a rectangle" on={tool === "rectangle"} set={choose("rectangle")} />
        <Toggle text="Mask a polygon" on={tool === "polygon"} set={choose("polygon")} />
        <OrderButton text="Apply" primary disabled={!mayChange.value || !changed} run={() => run(() => drawMasks(camera, drawn))} />
        <button class="button" type="button" disabled={!changed} onClick={() => setDrawn(inForce?.drawn ?? [])}>Discard</button>
        <OrderButton text="Undo" disabled={!mayChange.value || changed || !inForce?.undoSteps} run={() => run(() => undoMasks(camera))} />
      </div>
      {tool && <p class="soft" role="status">{kHints[tool]}</p>}
      {changed && <p class="look" role="status">Not applied yet.</p>}
      <OutcomeLine outcome={draft.outcome} />
    </div>
  );
}

export function MaskPanel({ camera, draft }: { camera: string; draft: MaskDraft }): JSX.Element {
  const { inForce, drawn, run } = draft;
  const learnt = inForce?.learnt.length ?? 0;
  return (
    <Panel title="Masks">
      <div class="stack">
        <p class="soft">The daemon ignores masked parts of the image: lamps, windows, other cameras.</p>
        {drawn.length > 0 ? <List draft={draft} /> : <p class="soft">No drawn mask.</p>}
        <ByNumbers draft={draft} />
        <p class="soft">{learnt} learnt {learnt === 1 ? "mask" : "masks"} (dashed). Learning masks what is bright now: nobody may be in the volume.</p>
        <div class="row">
          <OrderButton text="Learn mask" disabled={!mayChange.value} run={() => run(() => learnMasks(camera))} />
          <OrderButton text="Forget learnt" disabled={!mayChange.value || learnt === 0} run={() => run(() => forgetMasks(camera))} />
        </div>
      </div>
    </Panel>
  );
}
