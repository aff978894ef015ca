// The progress of a calibration of the running daemon, which the panels of the wand and of the floor share.

import type { JSX } from "preact";
import { useEffect, useState } from "preact/hooks";
import { type Calibration, CalibrationState } from "../../gen/mocap/v1/control_pb";
import { isRunning, lookAtCalibration } from "../state/calibration";
import { mayChange, open } from "../state/live";
import { type Outcome, order } from "../state/orders";
import { OrderButton, OutcomeLine } from "./small";

const kLookRunning_ms = 500;
const kLook_ms = 3000;

export interface LiveCalibration {
  progress: Calibration | null;
  looked: number;  // counts the answers
  outcome: Outcome | null;
  run(params: Record<string, unknown>): Promise<void>;
}

/** Follows the calibration of the daemon. */
export function useCalibration(applied: () => void): LiveCalibration {
  const [progress, setProgress] = useState<Calibration | null>(null);
  const [looked, setLooked] = useState(0);
  const [outcome, setOutcome] = useState<Outcome | null>(null);
  const look = async () => {
    try {
      setProgress(await lookAtCalibration());
      setLooked((count) => count + 1);
    } catch {
      setProgress(null);  // an older daemon, or none: the order to start says why
    }
  };
  const running = isRunning(progress);
  useEffect(() => {
    if (!open.value) return undefined;
    void look();
    const timer = window.setInterval(() => void look(), running ? kLookRunning_ms : kLook_ms);
    return () => window.clearInterval(timer);
  }, [open.value, running]);
  const run = async (params: Record<string, unknown>) => {
    const done = await order("calibration", params);
    setOutcome(done.good && !done.message ? null : done);
    await look();
    if (params.action === "ACTION_APPLY") applied();
  };
  return { progress, looked, outcome, run };
}

const kSentences: Partial<Record<CalibrationState, (progress: Calibration) => string>> = {
  [CalibrationState.COLLECTING]: (progress) => (progress.complete ? "Enough samples: solve, or go on waving." : progress.advice),
  [CalibrationState.SOLVING]: (progress) => `Solving: ${progress.step} ${Math.round(100 * progress.fraction)} %`,
  [CalibrationState.SOLVED]: () => "Solved. Apply writes the rig and uses it; the rig before is kept.",
  [CalibrationState.APPLIED]: () => "The rig is in force.",
  [CalibrationState.FAILED]: (progress) => `No result: ${progress.message}`,
  [CalibrationState.CANCELLED]: (progress) => `Cancelled: ${progress.message}`,
};

/** The state in a sentence, and the orders that it permits. */
export function CalibrationSteps({ calibration: { progress, outcome, run } }: { calibration: LiveCalibration }): JSX.Element | null {
  if (!progress) return <OutcomeLine outcome={outcome} />;
  const { state } = progress;
  const sentence = kSentences[state]?.(progress);
  const button = (text: string, action: string, primary = false) => <OrderButton primary={primary} text={text} disabled={!mayChange.value} run={() => run({ action })} />;
  return (
    <>
      {sentence && <p role="status"><strong>{sentence}</strong></p>}
      {isRunning(progress) && (
        <div class="row">
          {state === CalibrationState.COLLECTING && !progress.floor && button("Solve", "ACTION_SOLVE", progress.complete)}
          {button("Cancel", "ACTION_CANCEL")}
        </div>
      )}
      {state === CalibrationState.SOLVED && <div class="row">{button("Apply", "ACTION_APPLY", true)}{button("Discard", "ACTION_CANCEL")}</div>}
      <OutcomeLine outcome={outcome} />
    </>
  );
}
