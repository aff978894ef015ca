import type { ComponentChildren, JSX } from "preact";
import { useEffect, useRef } from "preact/hooks";
import { allKeys, helpShown, reasonsShown } from "../state/keys";
import { light, reasons } from "../state/live";
import { LevelMark, levelText } from "./level_mark";
import { CloseButton } from "./small";

function Dialog({ title, close, children }: { title: string; close(): void; children: ComponentChildren }): JSX.Element {
  const box = useRef<HTMLDialogElement>(null);
  useEffect(() => box.current?.showModal(), []);
  return (
    <dialog ref={box} onClose={close} aria-label={title} onClick={(event) => event.target === box.current && close()}>
      <header>
        <h1>{title}</h1>
        <CloseButton close={close} label="Close" />
      </header>
      {children}
    </dialog>
  );
}

export function ReasonList(): JSX.Element {
  if (reasons.value.length === 0) return <p class="soft">Cameras, clocks, latency, subjects and files are as they should be.</p>;
  return (
    <ul class="reasons">
      {reasons.value.map((reason) => (
        <li key={reason.text}>
          <LevelMark level={reason.level} />
          <span>{reason.text}</span>
          {reason.remedy && <span class="remedy">{reason.remedy}</span>}
        </li>
      ))}
    </ul>
  );
}

export function Dialogs(): JSX.Element {
  return (
    <>
      {helpShown.value && (
        <Dialog title="Keyboard" close={() => (helpShown.value = false)}>
          <dl class="keys">
            {allKeys().map((key) => [
              <dt key={key.key}><kbd>{key.shown}</kbd></dt>,
              <dd key={`${key.key}-does`}>{key.does}</dd>,
            ])}
          </dl>
        </Dialog>
      )}
      {reasonsShown.value && (
        <Dialog title={`Health: ${levelText[light.value].toLowerCase()}`} close={() => (reasonsShown.value = false)}>
          <ReasonList />
        </Dialog>
      )}
    </>
  );
}
