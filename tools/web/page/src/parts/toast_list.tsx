import type { JSX } from "preact";
import { closeToast, toasts } from "../state/toasts";
import { CloseButton } from "./small";

export function ToastList(): JSX.Element {
  return (
    <div class="toasts" role="status" aria-live="polite">
      {toasts.value.map((toast) => (
        <div key={toast.id} class={`toast ${toast.good ? "" : "bad"}`}>
          <p>{toast.text}</p>
          <CloseButton close={() => closeToast(toast.id)} label="Close the message" />
        </div>
      ))}
    </div>
  );
}
