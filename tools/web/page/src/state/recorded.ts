// Recorded takes: what mocap-web reads from the folder of the takes, and changes to it. Over HTTP, because files are large.

import { computed } from "@preact/signals";
import { DescriptionSchema, type Description } from "../../gen/mocap/v1/description_pb";
import { SnapshotSchema } from "../../gen/mocap/v1/snapshot_pb";
import { RequestError } from "../feed/connection";
import { kPiece_s, type TakeFrame } from "../model/take_frames";
import { wholePiece } from "../model/take_piece";
import { decode, open, server } from "./live";
import type { Outcome } from "./orders";

export interface TakeSummary {
  name: string;
  state: string;
  slate?: string;
  number?: number;
  seconds?: number;
  bytes?: number;
  /** "good", "look", "bad"; empty: not judged. */
  quality?: string;
  reasons?: string;
  notes?: string;
  tags?: string[];
  rating?: number | null;
  started?: string;
}

export interface TakeList {
  folder: string;
  takes: TakeSummary[];
  left_out: number;
}

export interface TakeFigures {
  quality?: string;
  sets?: number;
  lost_sets?: number;
  lost_images?: number;
  residual_px?: number;
  longest_gap_s?: number;
  cameras?: Record<string, number>;
  subjects?: { name: string; tracked: number; label_changes: number; residual_mm: number }[];
}

export interface TakeDetails extends TakeSummary {
  report: { quality: TakeFigures; damages: string[]; info: Record<string, string> };
}

interface ExportAnswer {
  state: "waiting" | "running" | "done" | "failed";
  progress: number;
  fault: string;
  file: string;
}

export const kFormats = ["c3d", "trc", "csv", "bvh", "gltf", "usd", "fbx"] as const;
const kLook_ms = 400;

/** Takes can be changed without a daemon, but not by a viewer. */
export const mayChangeTakes = computed(() => open.value && server.value !== null && server.value.role !== "viewer");

const pathOf = (name: string, verb = ""): string => `/api/v1/takes/${encodeURIComponent(name)}${verb && `/${verb}`}`;
export const fileOf = (name: string): string => `/takes/${encodeURIComponent(name)}.mcap`;

async function ask(path: string, init?: RequestInit): Promise<Response> {
  let reply: Response;
  try {
    reply = await fetch(path, init);
  } catch {
    throw new RequestError("disconnected", "there is no connection to mocap-web");
  }
  if (reply.ok) return reply;
  const said = await reply.text();
  let message = said.trim();
  try {
    message = JSON.parse(said).message ?? message;
  } catch {
    // A sentence.
  }
  throw new RequestError(String(reply.status), message || `mocap-web answers ${reply.status}`);
}

export const listTakes = async (): Promise<TakeList> => (await ask("/api/v1/takes")).json();
export const showTake = async (name: string): Promise<TakeDetails> => (await ask(pathOf(name))).json();
export const readPreflight = async (): Promise<unknown> => (await ask("/api/v1/preflight")).json();

/** Never rejects. */
async function outcomeOf(made: Promise<string>): Promise<Outcome> {
  try {
    return { good: true, message: await made };
  } catch (error) {
    return { good: false, message: error instanceof Error ? error.message : String(error) };
  }
}

export const changeTake = (name: string, verb: "edit" | "rename" | "delete", params: Record<string, unknown>): Promise<Outcome> =>
  outcomeOf(ask(pathOf(name, verb), { method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify(params) })
    .then((reply) => reply.json()).then((answer: { message?: string }) => answer.message ?? ""));

async function verified(name: string): Promise<string> {
  const { valid, faults } = (await (await ask(pathOf(name, "verify"))).json()) as { valid: boolean; faults: string[] };
  if (!valid) throw new RequestError("damaged", faults.join(". "));
  return "Every checksum and every message is right.";
}

export const verifyTake = (name: string): Promise<Outcome> => outcomeOf(verified(name));

/** Resolves to the address of the exported file. `progress`: 0 to 1. Rejects with a RequestError. */
export async function exportTake(name: string, format: string, progress: (share: number) => void): Promise<string> {
  for (;;) {
    const answer = (await (await ask(pathOf(name, `export?format=${format}`))).json()) as ExportAnswer;
    if (answer.state === "failed") throw new RequestError("failed", answer.fault || "the export failed");
    progress(answer.progress);
    if (answer.state === "done") return answer.file;
    await new Promise((resolve) => window.setTimeout(resolve, kLook_ms));
  }
}

/** Rejects with a RequestError. */
export async function takeFrames(name: string, from_s: number): Promise<TakeFrame[]> {
  const load = async (start_s: number, seconds: number) => (await ask(pathOf(name, `snapshots?from_s=${start_s}&seconds=${seconds}`))).arrayBuffer();
  const frames: TakeFrame[] = [];
  let description: Description | null = null;
  for (const { kind, at_s, payload } of await wholePiece(load, from_s, kPiece_s)) {
    if (kind === "description") description = decode(DescriptionSchema, payload) ?? description;
    else {
      const snapshot = decode(SnapshotSchema, payload);
      if (snapshot) frames.push({ at_s, snapshot, description });
    }
  }
  return frames;
}
