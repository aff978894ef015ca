// The masks of the daemon's cameras.

import { fromJson, type JsonValue } from "@bufbuild/protobuf";
import { AnswerSchema } from "../../gen/mocap/v1/control_pb";
import { type Masks, type Polygon, readMasks, writePolygons } from "../model/masks";
import { request } from "./live";
import { type Outcome, order } from "./orders";

// mocap-web waits 80 s for the daemon, which gives the cameras 70 s for 100 images (longest_learning of daemon/model/control.h).
const kLearning_ms = 85000;

/** Null: there is no such camera, or the daemon is older than drawn masks. Rejects with a RequestError. */
export async function listMasks(camera: string): Promise<Masks | null> {
  const answer = await request("mask", { action: "ACTION_LIST", camera });
  const { what } = fromJson(AnswerSchema, answer as JsonValue, { ignoreUnknownFields: true });
  return what.case === "masks" && what.value.cameras.length === 1 ? readMasks(what.value.cameras[0]) : null;
}

export const drawMasks = (camera: string, polygons: Polygon[]): Promise<Outcome> => order("mask", { action: "ACTION_DRAW", camera, polygons: writePolygons(polygons) });
export const undoMasks = (camera: string): Promise<Outcome> => order("mask", { action: "ACTION_UNDO", camera });
export const forgetMasks = (camera: string): Promise<Outcome> => order("mask", { action: "ACTION_FORGET", camera });
export const learnMasks = (camera: string): Promise<Outcome> => order("mask", { action: "ACTION_LEARN", camera }, kLearning_ms);
