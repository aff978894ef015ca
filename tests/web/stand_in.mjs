// Stands in for mocap-web: serves the page and speaks the same WebSocket, with the messages of a simulated daemon.

import { readFileSync } from "node:fs";
import { createServer } from "node:http";
import { extname, join, normalize } from "node:path";
import { SimulatedCalibration } from "./simulated_calibration.mjs";
import { kCameras, kRate_hz, SimulatedDaemon } from "./simulated_daemon.mjs";
import { SimulatedMasks } from "./simulated_masks.mjs";
import { SimulatedTakes } from "./simulated_takes.mjs";
import { webSockets } from "./modules.mjs";

const kTypes = { ".html": "text/html; charset=utf-8", ".js": "text/javascript; charset=utf-8", ".css": "text/css; charset=utf-8", ".svg": "image/svg+xml" };
// The same as mocap-web's, so that the tests see what the browser refuses.
const kPolicy = "default-src 'self'";
const RECORDING = 2, ENDED = 3, CANCELLED = 5, TAKE_STARTED = 6, TAKE_ENDED = 7;

function framed(topic, payload) {
  return Buffer.concat([Buffer.from([topic.length]), Buffer.from(topic, "ascii"), payload]);
}

/** One page. */
class Viewer {
  constructor(socket) {
    this.socket = socket;
    this.topics = new Set();
    this.acknowledged = true;
    this.dropped = 0;
  }

  send(topic, payload) {
    if (this.topics.has(topic)) this.socket.send(framed(topic, payload));
  }

  say(text) {
    this.socket.send(JSON.stringify(text));
  }
}

export class StandIn {
  /** `dist`: folder of the built page. */
  static async start(dist, port = 0) {
    const standIn = new StandIn(dist, await SimulatedDaemon.create());
    await new Promise((resolve) => standIn.server.listen(port, "127.0.0.1", resolve));
    standIn.run();
    return standIn;
  }

  constructor(dist, daemon) {
    this.daemon = daemon;
    this.role = "operator";
    this.connected = true;
    this.reason = "";
    /** False: the daemon sends no snapshots. */
    this.sending = true;
    this.number = 0;
    /** The number of the only set that is sent; null: all are sent. */
    this.still = null;
    /** What pages asked and said, for tests. */
    this.requests = [];
    this.drawn = 0;
    this.refusals = new Map();
    this.takes = new SimulatedTakes(daemon);
    /** The findings of preflight. */
    this.findings = [
      { check: "camera cam1", verdict: "good", what: "60.0 images a second", cure: "" }, { check: "subject camera-prop", verdict: "warning", what: "2 of 4 markers are seen", cure: "mocap-watch --doctor" },
      { check: "disk", verdict: "good", what: "room for 412 minutes of takes", cure: "", minutes: 412 },
    ];
    this.calibration = new SimulatedCalibration(kCameras);
    this.masks = new SimulatedMasks();
    /** C3D files that were sent, and the answer to the next one. */
    this.uploads = [];
    this.imported = { status: 200, answer: { code: "CODE_DONE", message: "added", report: {}, warnings: [] } };
    /** The shot list of the daemon. */
    this.shots = [];
    this.viewers = new Set();
    this.server = createServer((request, reply) => this.serve(dist, request, reply));
    const { WebSocketServer } = webSockets();
    this.sockets = new WebSocketServer({ server: this.server, path: "/ws", handleProtocols: (offered) => (offered.has("mocap.v1") ? "mocap.v1" : false) });
    this.sockets.on("connection", (socket) => this.join(socket));
  }

  get address() {
    return `http://127.0.0.1:${this.server.address().port}/`;
  }

  async stop() {
    clearInterval(this.timer);
    this.cut();
    await new Promise((resolve) => this.server.close(resolve));
  }

  /** Closes the connections of all pages. */
  cut() {
    for (const viewer of this.viewers) viewer.socket.terminate();
  }

  event(kind, fields) {
    const payload = this.daemon.event(kind, fields, Date.now());
    for (const viewer of this.viewers) viewer.send("event", payload);
  }

  sendHealth() {
    const payload = this.daemon.health(this.number, Date.now());
    for (const viewer of this.viewers) viewer.send("health", payload);
  }

  sendDescription() {
    for (const viewer of this.viewers) viewer.send("description", this.daemon.description());
  }

  sendState() {
    for (const viewer of this.viewers) this.sayState(viewer);
  }

  /** The API over HTTP; false: the request is for a file of the page. */
  async serveApi(request, reply) {
    const url = new URL(request.url, "http://localhost");
    const parts = [];
    for await (const part of request) parts.push(part);
    const text = Buffer.concat(parts).toString();
    if (url.pathname === "/api/v1/subjects/import") return this.importC3d(request, url, Buffer.concat(parts), reply);
    const answer = url.pathname === "/api/v1/preflight" ? [200, this.findings] : this.takes.answer(request.method, url, text && JSON.parse(text));
    if (!answer) return false;
    const [status, body] = answer;
    const json = !Buffer.isBuffer(body);
    const attachment = url.pathname.startsWith("/takes/") ? { "Content-Disposition": "attachment" } : {};
    reply.writeHead(status, { "Content-Type": json ? "application/json" : "application/octet-stream", ...attachment }).end(json ? JSON.stringify(body) : body);
    return true;
  }

  /** The answer that a test has planted. */
  importC3d(request, url, bytes, reply) {
    this.uploads.push({ method: request.method, type: request.headers["content-type"], name: url.searchParams.get("name"), atRest: url.searchParams.get("static"), bytes: bytes.length });
    reply.writeHead(this.imported.status, { "Content-Type": "application/json" }).end(JSON.stringify(this.imported.answer));
    return true;
  }

  async serve(dist, request, reply) {
    if (await this.serveApi(request, reply)) return;
    const path = normalize(new URL(request.url, "http://localhost").pathname);
    const name = path === "/" ? "index.html" : path.slice(1);
    let content;
    try {
      content = readFileSync(join(dist, name));
    } catch {
      reply.writeHead(404).end();
      return;
    }
    reply.writeHead(200, { "Content-Type": kTypes[extname(name)] ?? "application/octet-stream", "Content-Security-Policy": kPolicy }).end(content);
  }

  run() {
    this.timer = setInterval(() => {
      if (!this.sending) return;
      this.number++;
      for (const viewer of this.viewers) this.offer(viewer);
      if (this.number % 6 === 0) this.sendPreviews();
      if (this.number % kRate_hz === 0) this.second();
    }, 1000 / kRate_hz);
  }

  sendPreviews() {
    for (const viewer of this.viewers) {
      for (const topic of viewer.topics) {
        const camera = /^preview\/cam(\d+)$/.exec(topic);
        if (camera) viewer.send(topic, this.daemon.preview(Number(camera[1]) - 1, this.number, Date.now()));
      }
    }
  }

  second() {
    if (this.daemon.take?.state === RECORDING) {
      this.daemon.take.seconds += 1;
      this.daemon.take.sets += BigInt(kRate_hz);
      this.daemon.take.sizeBytes += 500_000n;
    }
    this.sendHealth();
    this.sendDescription();
    this.sendState();
    for (const viewer of this.viewers) viewer.say({ dropped: { snapshot: viewer.dropped } });
  }

  /** The newest snapshot, if the page has drawn the one before. */
  offer(viewer) {
    if (!viewer.topics.has("snapshot")) return;
    if (!viewer.acknowledged) {
      viewer.dropped++;
      return;
    }
    viewer.acknowledged = false;
    const number = this.still ?? this.number;
    viewer.send("sightings", this.daemon.sightings(number, Date.now()));
    viewer.send("snapshot", this.daemon.snapshot(number, Date.now()));
  }

  sayState(viewer) {
    viewer.say({ state: { connected: this.connected, age_s: 0.01, endpoint: "tcp://127.0.0.1:5570", reason: this.reason, role: this.role, version: "stand-in 1" } });
  }

  join(socket) {
    const viewer = new Viewer(socket);
    this.viewers.add(viewer);
    socket.on("close", () => this.viewers.delete(viewer));
    socket.on("error", () => socket.terminate());
    socket.on("message", (data) => this.take(viewer, JSON.parse(String(data))));
    this.sayState(viewer);
  }

  take(viewer, text) {
    if (text.subscribe) this.subscribe(viewer, text.subscribe);
    if (text.drawn !== undefined) {
      viewer.acknowledged = true;
      this.drawn++;
    }
    if (text.request) this.answer(viewer, text.request);
  }

  subscribe(viewer, topics) {
    const before = viewer.topics;
    viewer.topics = new Set(topics);
    viewer.acknowledged = true;
    if (!before.has("description")) viewer.send("description", this.daemon.description());
    if (!before.has("health")) viewer.send("health", this.daemon.health(this.number, Date.now()));
  }

  answer(viewer, { id, method, params }) {
    const looks = (method === "calibration" && SimulatedCalibration.looks(params)) || SimulatedMasks.lists(method, params);
    if (!looks) this.requests.push({ method, params });
    const fault = this.refusals.get(method) ?? this.faultOf(method, params);
    if (fault) {
      viewer.say({ answer: { id, ok: false, error: fault } });
      return;
    }
    if (params.action === "ACTION_IMPORT") this.shots = params.shots;
    if (params.action === "ACTION_CLEAR") this.shots = [];
    const list = method === "calibration" ? this.calibration.answer(params) : method === "mask" ? this.masks.answer(params) : method === "shots" ? { shots: { shots: this.shots } } : {};
    const message = method === "take" ? this.record(params) : list.calibration || list.rigs ? "" : `${method}: done`;
    viewer.say({ answer: { id, ok: true, result: { id: String(id), code: "CODE_DONE", message, ...list } } });
  }

  /** The parameters must be Protobuf's JSON of the request. */
  faultOf(method, params) {
    try {
      this.daemon.wire.check(`${method[0].toUpperCase()}${method.slice(1)}Request`, params);
    } catch (error) {
      return { code: "CODE_INVALID", message: String(error) };
    }
    return this.role === "viewer" && params.action !== "ACTION_LIST" && params.action !== "ACTION_STATUS" ? { code: "CODE_FORBIDDEN", message: "the role viewer does not permit this request" } : null;
  }

  record({ action, slate }) {
    const { daemon } = this;
    if (action === "ACTION_START" || action === "ACTION_NEXT") {
      daemon.takes++;
      const shot = action === "ACTION_NEXT" && this.shots.find(({ done }) => !done);
      if (shot) shot.done = true;
      const name = shot ? shot.name : `${slate || "take"}_${String(daemon.takes).padStart(3, "0")}`;
      daemon.take = { state: RECORDING, name, path: `/var/lib/mocapd/takes/${name}.mcap`, seconds: 0, sizeBytes: 0n, sets: 0n, quality: 1 };
      this.event(TAKE_STARTED, { message: name });
    } else if (action === "ACTION_STOP" && daemon.take) {
      daemon.take.state = ENDED;
      this.event(TAKE_ENDED, { message: `${daemon.take.name}: good` });
    } else if (action === "ACTION_CANCEL" && daemon.take) {
      daemon.take.state = CANCELLED;
    }
    this.sendHealth();
    return daemon.take ? daemon.take.path : "done";
  }
}
