// Small parts that several pages use.

import type { ComponentChildren, JSX } from "preact";
import { useState } from "preact/hooks";
import type { Outcome } from "../state/orders";
import { say } from "../state/toasts";
import { Icon } from "./icons";

export function Panel({ title, tools, class: extra = "", children }: { title: string; tools?: ComponentChildren; class?: string; children: ComponentChildren }): JSX.Element {
  return (
    <section class={`panel ${extra}`} aria-label={title}>
      <header>
        <h2>{title}</h2>
        {tools}
      </header>
      {children}
    </section>
  );
}

/** A command line that can be copied. */
export function Command({ text }: { text: string }): JSX.Element {
  const copy = () =>
    navigator.clipboard
      ? navigator.clipboard.writeText(text).then(() => say("Copied"), () => say("The browser refused to copy; select the text instead", false))
      : say("The browser copies only over HTTPS or on localhost; select the text instead", false);
  return (
    <div class="command">
      <code tabIndex={0} role="textbox" aria-readonly="true" aria-label={`Command: ${text}`}>{text}</code>
      <button class="button" type="button" onClick={copy} aria-label={`Copy the command ${text}`}>Copy</button>
    </div>
  );
}

export function OutcomeLine({ outcome }: { outcome: Outcome | null }): JSX.Element | null {
  if (!outcome) return null;
  return (
    <p class={`answer ${outcome.good ? "good" : "bad"}`} role="status">
      <span>{outcome.message || "Done"}</span>
    </p>
  );
}

/** A button that is disabled while its order is under way. */
export function OrderButton({ text, run, disabled, primary }: { text: string; run(): Promise<unknown>; disabled?: boolean; primary?: boolean }): JSX.Element {
  const [busy, setBusy] = useState(false);
  const click = () => {
    setBusy(true);
    void run().finally(() => setBusy(false));
  };
  return (
    <button class={`button ${primary ? "primary" : ""}`} type="button" disabled={disabled || busy} onClick={click}>
      {busy ? `${text}…` : text}
    </button>
  );
}

/** 0 to 1; below `low` it is coloured. */
export function Meter({ share, low, label }: { share: number; low: number; label: string }): JSX.Element {
  const width = 100 * Math.min(1, Math.max(0, share));
  return (
    <svg class={`meter ${share < low ? "low" : ""}`} viewBox="0 0 100 6" preserveAspectRatio="none" role="img" aria-label={label}>
      <rect width="100" height="6" rx="3" />
      <rect width={width} height="6" rx="3" />
    </svg>
  );
}

export function Toggle({ text, on, set, hint }: { text: string; on: boolean; set(on: boolean): void; hint?: string }): JSX.Element {
  return (
    <button class="button" type="button" aria-pressed={on} title={hint} onClick={() => set(!on)}>
      {text}
    </button>
  );
}

export function CloseButton({ close, label }: { close(): void; label: string }): JSX.Element {
  return (
    <button class="icon-button" type="button" onClick={close} aria-label={label}>
      <Icon name="close" />
    </button>
  );
}
