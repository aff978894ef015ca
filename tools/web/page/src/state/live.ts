// All data of the page. The connection writes; parts read signals. A snapshot goes to the canvases at once and to the rest of the
// page four times a second.

import { fromBinary, type DescMessage, type MessageShape } from "@bufbuild/protobuf";
import { computed, signal } from "@preact/signals";
import { type Description, DescriptionSchema } from "../../gen/mocap/v1/description_pb";
import { EventSchema } from "../../gen/mocap/v1/event_pb";
import { type Health, HealthSchema } from "../../gen/mocap/v1/health_pb";
import { type Snapshot, SnapshotSchema } from "../../gen/mocap/v1/snapshot_pb";
import { Connection } from "../feed/connection";
import type { FeedMessage } from "../feed/message";
import type { ServerState, ServerText } from "../feed/server_text";
import { WantedTopics } from "../feed/topics";
import { DataAge } from "../model/data_age";
import { healthReasons, worst } from "../model/health_report";
import { History } from "../model/history";
import { MarkerWatch } from "../model/marker_watch";
import type { Finding } from "../model/preflight";
import { RecentSnapshots } from "../model/recent_snapshots";
import { exposedUtc_ms } from "../model/timecode";

const kSlowPace_ms = 250;

export const open = signal(false);
export const closedBecause = signal("the page has just been opened");
export const server = signal<ServerState | null>(null);
export const description = signal<Description | null>(null);
export const health = signal<Health | null>(null);
/** Of the last preflight; null: none has ended. */
export const findings = signal<Finding[] | null>(null);
/** Of the last 250 ms; canvases use onFrame. */
export const snapshot = signal<Snapshot | null>(null);
/** Counts events. */
export const eventCount = signal(0);
/** Snapshots that this viewer missed, as the server counts them. */
export const missed = signal(0);
/** performance.now(), four times a second while the page is visible. */
export const now_ms = signal(performance.now());
/** Since the newest snapshot came, at `now_ms`. Null: none came yet. */
export const silent_s = signal<number | null>(null);

export const history = new History();
export const markers = new MarkerWatch();
export const dataAge = new DataAge();
export const recent = new RecentSnapshots();

/** Everything that needs the role operator is offered only to an operator; the daemon checks it again. */
export const mayChange = computed(() => open.value && server.value?.connected === true && server.value.role !== "viewer");
export const reasons = computed(() => healthReasons({
  open: open.value, findings: findings.value, closedBecause: closedBecause.value, server: server.value, description: description.value, health: health.value,
  silent_s: silent_s.value,
}));
export const light = computed(() => worst(reasons.value));

type FrameListener = (snapshot: Snapshot) => void;
const frameListeners = new Set<FrameListener>();
const topicListeners = new Map<string, Set<(payload: Uint8Array) => void>>();
let newest: Snapshot | null = null;
let newestAt_ms = 0;
let frameWaits = false;
/** Parts that need every frame; without one the page acknowledges four frames a second. */
let liveParts = 0;

/** Returns null for a payload that is not such a message. */
export function decode<Desc extends DescMessage>(schema: Desc, payload: Uint8Array): MessageShape<Desc> | null {
  try {
    return fromBinary(schema, payload, { readUnknownFields: false });
  } catch {
    return null;
  }
}

/** The newest snapshot, for a canvas that is drawn for another reason. */
export const newestSnapshot = (): Snapshot | null => newest;

/** Calls `draw` with the newest snapshot in each animation frame that has one. Returns the function that ends it. */
export function onFrame(draw: FrameListener): () => void {
  frameListeners.add(draw);
  liveParts++;
  return () => {
    if (frameListeners.delete(draw)) liveParts--;
  };
}

function drawNewest(): void {
  frameWaits = false;
  if (!newest) return;
  for (const draw of frameListeners) draw(newest);
  connection.drawn(Number(newest.number));
}

function scheduleFrame(): void {
  if (frameWaits) return;
  frameWaits = true;
  if (liveParts > 0) requestAnimationFrame(drawNewest);
  else window.setTimeout(() => requestAnimationFrame(drawNewest), kSlowPace_ms);
}

function takeSnapshot(received: Snapshot): void {
  const now = performance.now();
  newest = received;
  if (received.descriptionVersion === description.peek()?.version) markers.add(received, now);
  recent.add(received);
  const exposed_ms = exposedUtc_ms(received);
  if (exposed_ms !== null) dataAge.add(exposed_ms, Date.now());
  newestAt_ms = now;
  if (snapshot.peek() === null) tick();
  scheduleFrame();
}

function tick(): void {
  now_ms.value = performance.now();
  snapshot.value = newest;
  silent_s.value = newest ? (now_ms.value - newestAt_ms) / 1000 : null;
}

function takeDescription(received: Description): void {
  const before = description.peek();
  if (before && before.sessionId === received.sessionId && before.version === received.version) return;
  markers.clear(); // its indices are those of the description
  description.value = received;
}

function takeMessage({ topic, payload }: FeedMessage): void {
  const listeners = topicListeners.get(topic);
  if (listeners) for (const listen of listeners) listen(payload);
  if (topic === "snapshot") {
    const received = decode(SnapshotSchema, payload);
    if (received) takeSnapshot(received);
  } else if (topic === "description") {
    const received = decode(DescriptionSchema, payload);
    if (received) takeDescription(received);
  } else if (topic === "health") {
    const received = decode(HealthSchema, payload);
    if (!received) return;
    history.addHealth(received, Date.now() / 1000);
    health.value = received;
  } else if (topic === "event") {
    const received = decode(EventSchema, payload);
    if (!received) return;
    history.addEvent(received, Date.now() / 1000);
    eventCount.value++;
  }
}

function takeText(text: ServerText): void {
  if (text.state) server.value = text.state;
  if (text.dropped) missed.value = text.dropped.get("snapshot") ?? missed.peek();
}

const scheme = location.protocol === "https:" ? "wss" : "ws";
const connection = new Connection(`${scheme}://${location.host}/ws`, {
  opened() {
    open.value = true;
    frameWaits = false;
  },
  closed(reason) {
    open.value = false;
    closedBecause.value = reason;
    server.value = null;
  },
  message: takeMessage,
  text: takeText,
});

export const topics = new WantedTopics((wanted) => connection.subscribe(wanted));

/** Subscribes to a topic and calls `listen` with each payload. Returns the function that ends it. */
export function onTopic(topic: string, listen: (payload: Uint8Array) => void): () => void {
  const listeners = topicListeners.get(topic) ?? new Set();
  topicListeners.set(topic, listeners);
  listeners.add(listen);
  const end = topics.want(topic);
  return () => {
    listeners.delete(listen);
    if (listeners.size === 0) topicListeners.delete(topic);
    end();
  };
}

/** Sends a request of the control protocol; rejects with a RequestError. */
export const request = (method: string, params: unknown, patience_ms?: number): Promise<unknown> => connection.request(method, params, patience_ms);

/** Starts the connection and the page's clock. Called once. */
export function startLive(): void {
  for (const topic of ["description", "snapshot", "health", "event"]) topics.want(topic);
  connection.connect();
  window.setInterval(() => {
    if (!document.hidden) tick();
  }, kSlowPace_ms);
  const follow = () => {
    topics.setHidden(document.hidden);
    if (!document.hidden) connection.connect();
  };
  document.addEventListener("visibilitychange", follow);
  window.addEventListener("online", () => connection.connect());
  follow();
}
