// Orders of the operator to the daemon: the requests of the control protocol, in Protobuf's JSON.

import { signal } from "@preact/signals";
import { type TakeHealth, TakeState } from "../../gen/mocap/v1/health_pb";
import { RequestError } from "../feed/connection";
import { health, request } from "./live";
import { store, stored } from "./storage";
import { say } from "./toasts";

export interface Outcome {
  good: boolean;
  /** For the operator: the result, or the fault and its remedy. */
  message: string;
}

/** Never rejects. */
export async function order(method: string, params: Record<string, unknown>, patience_ms?: number): Promise<Outcome> {
  try {
    const result = await request(method, params, patience_ms);
    const message = (result as { message?: unknown } | null)?.message;
    return { good: true, message: typeof message === "string" ? message : "" };
  } catch (error) {
    return { good: false, message: error instanceof RequestError ? error.message : String(error) };
  }
}

/** The outcome becomes a message on the page. */
export async function orderAndSay(what: string, method: string, params: Record<string, unknown>): Promise<Outcome> {
  const outcome = await order(method, params);
  if (outcome.good) say(outcome.message || `${what}: done`);
  else say(`${what}: ${outcome.message}`, false);
  return outcome;
}

// What the next take is called. The header and the page Takes show the same.
export const slate = signal(stored("slate", ""));
export const countdown_s = signal(Number(stored("countdown", "0")) || 0);
export const notes = signal("");
export const before_s = signal(0);
export const limit_s = signal(0);
/** An order to start or stop is under way. */
export const takeBusy = signal(false);

export const activeTake = (): TakeHealth | null => {
  const take = health.value?.take;
  return take && (take.state === TakeState.RECORDING || take.state === TakeState.WAITING) ? take : null;
};

async function take(what: string, params: Record<string, unknown>): Promise<Outcome> {
  takeBusy.value = true;
  const outcome = await orderAndSay(what, "take", params);
  takeBusy.value = false;
  return outcome;
}

export function startTake(): Promise<Outcome> {
  store("slate", slate.peek());
  store("countdown", String(countdown_s.peek()));
  return take("Record", {
    action: "ACTION_START", slate: slate.peek().trim(), text: notes.peek().trim(), beforeS: before_s.peek(), seconds: limit_s.peek(),
    countdownS: countdown_s.peek(),
  });
}

export const stopTake = (): Promise<Outcome> => take("Stop", { action: "ACTION_STOP" });
export const cancelTake = (): Promise<Outcome> => take("Cancel", { action: "ACTION_CANCEL" });
export const nextTake = (): Promise<Outcome> => take("Next take", { action: "ACTION_NEXT", slate: slate.peek().trim() });
/** The slate and notes of the shot apply, not those of the form. */
export const nextShot = (): Promise<Outcome> => take("Next shot", { action: "ACTION_NEXT" });
export const markTake = (text: string): Promise<Outcome> => orderAndSay("Mark", "take", { action: "ACTION_MARK", text });
export const subjectOrder = (what: string, name: string, action: string): Promise<Outcome> =>
  orderAndSay(`${name}: ${what}`, "subject", { action, name });
