// The calibration of the running daemon: its progress, and the rigs that the daemon keeps.

import { fromJson, type JsonValue } from "@bufbuild/protobuf";
import { type Answer, AnswerSchema, type Calibration, CalibrationState, type KeptRig } from "../../gen/mocap/v1/control_pb";
import { request } from "./live";

async function ask(action: string): Promise<Answer["what"]> {
  const answer = await request("calibration", { action });
  return fromJson(AnswerSchema, answer as JsonValue, { ignoreUnknownFields: true }).what;
}

/** Rejects with a RequestError. */
export async function lookAtCalibration(): Promise<Calibration | null> {
  const what = await ask("ACTION_STATUS");
  return what.case === "calibration" ? what.value : null;
}

/** Rejects with a RequestError. */
export async function listRigs(): Promise<KeptRig[]> {
  const what = await ask("ACTION_LIST");
  return what.case === "rigs" ? what.value.rigs : [];
}

export const isRunning = (calibration: Calibration | null): boolean =>
  calibration?.state === CalibrationState.COLLECTING || calibration?.state === CalibrationState.SOLVING;

/** Positions of the wand's markers in m from "0, 160, 500" in mm; null: not two or three ascending numbers from 0. */
export function wandMarks_m(text: string): number[] | null {
  const marks = text.split(/[,;\s]+/).filter((part) => part !== "").map((part) => Number(part) / 1000);
  const ascending = marks.every((mark, i) => (i === 0 ? mark === 0 : mark > marks[i - 1]));
  return ascending && (marks.length === 2 || marks.length === 3) ? marks : null;
}
