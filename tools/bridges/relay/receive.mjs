#!/usr/bin/env node
// Receives the poses that mocap-relay sends to a NATS server, and prints them. Needs Node.js 18 alone.
//
// usage: receive.mjs SERVER [--prefix PREFIX] [--subject NAME] [--ca FILE] [--credentials FILE] [--json] [--seconds S]
//
// The options and the output are those of receive.py.
// exit codes: 0 poses came, 64 wrong command line, 69 none came
import fs from "node:fs";
import net from "node:net";
import tls from "node:tls";
import { parseArgs } from "node:util";

const RETRY_MS = 1000;
const CONNECT_MS = 5000;
const SILENCE_MS = 15000; // the feed has a message a second
const MOST_BYTES = 8 << 20; // of one message
const UNITS_PER_M = 1e4;
const STEPS = 16383 * Math.SQRT2;

// ---- Messages of the feed ----

/** The fields of a Protobuf message: [number, value]; the value is a number or a Buffer. */
function* fields(message) {
  let at = 0;
  const varint = () => {
    let value = 0n;
    for (let shift = 0n; ; shift += 7n) {
      const byte = message.readUInt8(at++);
      value |= BigInt(byte & 0x7f) << shift;
      if (byte < 0x80) return Number(value);
    }
  };
  while (at < message.length) {
    const tag = varint();
    if ((tag & 7) === 0) {
      yield [tag >> 3, varint()];
      continue;
    }
    const size = { 1: 8, 5: 4 }[tag & 7] ?? varint();
    yield [tag >> 3, message.subarray(at, at + size)];
    at += size;
  }
}

function readBone(message) {
  const bone = { name: "", parent: -1, offset: [0, 0, 0] };
  for (const [number, value] of fields(message)) {
    if (number === 1) bone.name = value.toString();
    if (number === 2) bone.parent = value;
    if (number === 3) for (const [axis, bits] of fields(value)) bone.offset[axis - 1] = bits.readDoubleLE(0);
  }
  return bone;
}

function readSubject(message) {
  const subject = { name: "", bones: [] };
  for (const [number, value] of fields(message)) {
    if (number === 1) subject.name = value.toString();
    if (number === 4) subject.bones.push(readBone(value));
  }
  return subject;
}

/** Version and subjects, by name. */
function readDescription(message) {
  const description = { version: 0, subjects: new Map() };
  for (const [number, value] of fields(message)) {
    if (number === 2) description.version = value;
    if (number !== 8) continue;
    const subject = readSubject(value);
    description.subjects.set(subject.name, subject);
  }
  return description;
}

/** x y z w; null: the bone is lost. The bits are in an integer of 48 bits, of which a number is exact. */
function unpackRotation(bits) {
  const part = (shift, count) => Math.floor(bits / 2 ** shift) % 2 ** count;
  if (part(47, 1) === 1) return null;
  let small = [0, 15, 30].map((shift) => (part(shift, 15) - 16384) / STEPS);
  const squares = small.reduce((sum, value) => sum + value * value, 0);
  if (squares > 1) small = small.map((value) => value / Math.sqrt(squares));
  small.splice(part(45, 2), 0, Math.sqrt(Math.max(0, 1 - squares)));
  return small;
}

/** A message of the topic lite/NAME: see proto/lite/README.md. */
export function decodeLite(message) {
  const bones = (message.length - 37) / 6;
  if (bones < 0 || !Number.isInteger(bones) || message[0] !== 1 || message[3] + bones > message[2]) {
    throw new Error("no message of a topic lite/NAME");
  }
  const flags = message[1];
  return {
    phase: { 2: "tracking", 3: "lost" }[flags & 3] ?? "searching",
    outOfRange: (flags & 4) !== 0,
    offRest: (flags & 8) !== 0,
    subjectBones: message[2],
    firstBone: message[3],
    version: message.readUInt32LE(4),
    sequence: message.readUInt32LE(8),
    number: message.readBigUInt64LE(12),
    exposedUtcNs: message.readBigInt64LE(20),
    root: [28, 31, 34].map((at) => message.readIntLE(at, 3) / UNITS_PER_M),
    rotations: Array.from({ length: bones }, (_, i) => unpackRotation(message.readUIntLE(37 + 6 * i, 6))),
  };
}

function rotate([x, y, z, w], v) {
  const t = [2 * (y * v[2] - z * v[1]), 2 * (z * v[0] - x * v[2]), 2 * (x * v[1] - y * v[0])];
  return [
    v[0] + w * t[0] + y * t[2] - z * t[1],
    v[1] + w * t[1] + z * t[0] - x * t[2],
    v[2] + w * t[2] + x * t[1] - y * t[0],
  ];
}

/** World position and rotation of each bone that has a pose, by name. A bone below a lost one has no position. */
function poses(subject, root, rotations) {
  const found = [];
  const bones = subject.bones.slice(0, rotations.length); // none if the subject has no pose
  for (const [i, bone] of bones.entries()) {
    const rotation = rotations[i];
    const above = found[bone.parent];
    let position = null;
    if (rotation !== null && bone.parent < 0) position = root;
    if (rotation !== null && above?.position) {
      position = rotate(above.rotation, bone.offset).map((value, axis) => value + above.position[axis]);
    }
    found.push({ position, rotation });
  }
  const named = {};
  for (const [i, bone] of bones.entries()) {
    const { position, rotation } = found[i];
    if (rotation !== null) named[bone.name] = { position_m: position, rotation_xyzw: rotation };
  }
  return named;
}

// ---- NATS ----

/** Receives subjects from a NATS server until the connection ends. Protocol: docs.nats.io, "NATS client protocol". */
class Nats {
  /** `take(subject, payload)` gets each message. `ended(fault)` is called once. */
  constructor(server, login, subjects, take, ended) {
    Object.assign(this, { server, login, subjects, take, waiting: Buffer.alloc(0), open: true, ready: false });
    this.ended = (fault) => {
      if (!this.open) return;
      this.open = false;
      this.socket.destroy();
      ended(fault);
    };
    this.use(net.connect(server.port, server.host));
    this.socket.setTimeout(CONNECT_MS);
  }

  use(socket) {
    this.socket = socket;
    socket.setNoDelay(true);
    socket.on("error", (fault) => this.ended(fault.message));
    socket.on("close", () => this.ended("the server closed the connection"));
    socket.on("timeout", () => this.ended("the server is silent"));
    socket.on("data", (data) => this.read(data));
  }

  close() {
    this.ended("");
  }

  read(data) {
    this.waiting = Buffer.concat([this.waiting, data]);
    try {
      while (this.open && this.step());
    } catch (fault) {
      this.ended(fault.message);
    }
  }

  /** Processes one line and its message. Returns false if more bytes are needed. */
  step() {
    const end = this.waiting.indexOf("\r\n");
    if (end < 0) {
      if (this.waiting.length > 65536) throw new Error("this is no NATS server");
      return false;
    }
    const words = this.waiting.toString("utf8", 0, end).split(" ");
    if (!this.ready && !["INFO", "-ERR"].includes(words[0])) throw new Error("this is no NATS server: it does not begin with INFO");
    if (words[0] === "MSG") {
      const size = Number(words.at(-1));
      if (!(size <= MOST_BYTES)) throw new Error("a message that is too large");
      if (this.waiting.length < end + 2 + size + 2) return false;
      this.take(words[1], this.waiting.subarray(end + 2, end + 2 + size));
      this.waiting = this.waiting.subarray(end + 2 + size + 2);
      return true;
    }
    const line = this.waiting.toString("utf8", 0, end);
    this.waiting = this.waiting.subarray(end + 2);
    if (words[0] === "INFO" && !this.ready) this.greet(JSON.parse(line.slice(5)));
    if (words[0] === "PING") this.socket.write("PONG\r\n");
    if (words[0] === "-ERR") throw new Error(`the server says ${line.slice(5)}`);
    return true;
  }

  greet(info) {
    this.ready = true;
    const { host, ca } = this.server;
    const secure = this.server.tls || info.tls_required === true;
    if (!secure) return this.introduce();
    if (!info.tls_required && !info.tls_available) throw new Error("the server has no TLS");
    if (this.waiting.length > 0) throw new Error("bytes came before TLS, which anybody between may have sent");
    const plain = this.socket;
    plain.removeAllListeners("data");
    plain.setTimeout(0);
    const options = net.isIP(host) ? { host } : { host, servername: host };
    this.use(tls.connect({ socket: plain, ca, ...options }, () => this.introduce()));
    this.socket.setTimeout(CONNECT_MS);
  }

  introduce() {
    const hello = { verbose: false, pedantic: false, tls_required: this.server.tls, lang: "javascript", version: "1", protocol: 1, ...this.login };
    const subscriptions = this.subjects.map((subject, i) => `SUB ${subject} ${i + 1}\r\n`).join("");
    this.socket.write(`CONNECT ${JSON.stringify(hello)}\r\n${subscriptions}`);
    this.socket.setTimeout(SILENCE_MS);
  }
}

// ---- The program ----

/** The messages that were received for one subject: counts, ages, and the newest message. */
class Received {
  parts = new Map();
  number = null;
  nextSequence = null;
  count = 0;
  lost = 0;
  second = []; // ages of the poses of this second, ms
  newest = null; // the last message whose bones are known

  /** Counts the messages between the last one and this one as lost. */
  note(sequence) {
    if (this.nextSequence !== null && sequence > this.nextSequence) this.lost += sequence - this.nextSequence;
    this.nextSequence = sequence + 1; // a lower one: the daemon started again
  }

  /** Adds the bones of a message. Returns the rotations of all bones if the instant is complete, otherwise null. */
  add(lite, subject) {
    this.newest = lite;
    if (lite.number !== this.number) {
      this.number = lite.number;
      this.parts.clear();
    }
    this.parts.set(lite.firstBone, lite.rotations);
    const rotations = [...this.parts.keys()].sort((a, b) => a - b).flatMap((first) => this.parts.get(first));
    if (rotations.length !== lite.subjectBones) return null;
    if (rotations.length > 0 && rotations.length !== subject.bones.length) return null;
    this.count += 1;
    this.second.push(Date.now() - Number(lite.exposedUtcNs / 1000n) / 1000);
    return rotations;
  }
}

class Program {
  description = { version: null, subjects: new Map() };
  received = new Map();

  constructor(options) {
    this.options = options;
    this.prefix = `mocap.${options.prefix}.`;
  }

  take(subject, payload) {
    const topic = subject.slice(this.prefix.length);
    if (topic === "description") {
      this.description = readDescription(payload);
      return;
    }
    const name = decodeURIComponent(topic.slice("lite.".length));
    const lite = this.read(payload);
    if (lite === null) return;
    if (!this.received.has(name)) this.received.set(name, new Received());
    const received = this.received.get(name);
    received.note(lite.sequence);
    const known = this.description.subjects.get(name);
    if (known === undefined || lite.version !== this.description.version) return; // the description is about to arrive
    const rotations = received.add(lite, known);
    if (rotations === null || !this.options.json) return;
    const { outOfRange, offRest } = lite;
    const bones = poses(known, lite.root, rotations);
    const head = `"number": ${lite.number}, "exposed_at_utc_ns": ${lite.exposedUtcNs}`; // more digits than a number has
    const tail = { age_ms: received.second.at(-1), lost: received.lost, phase: lite.phase, out_of_range: outOfRange, off_rest: offRest, bones };
    console.log(`{"subject": ${JSON.stringify(name)}, ${head}, ${JSON.stringify(tail).slice(1)}`);
  }

  /** Null: a message of another layout. */
  read(payload) {
    try {
      return decodeLite(payload);
    } catch {
      return null;
    }
  }

  /** One line for each subject, once a second. */
  show() {
    for (const [name, received] of this.received) {
      const ages = received.second.sort((a, b) => a - b);
      received.second = [];
      if (this.options.json) continue;
      if (ages.length === 0) {
        console.log(`${name}: silent`);
        continue;
      }
      const at = received.newest.root.map((value) => value.toFixed(3).padStart(7)).join(" ");
      const age = ages[Math.floor(ages.length / 2)].toFixed(1);
      const { count, lost } = received;
      console.log(`${name}: ${received.newest.phase}, root ${at} m, ${ages.length} Hz, age ${age} ms, ${lost} of ${count + lost} lost`);
    }
  }

  /** Receives until the time is over; connects again by itself. */
  run(server, login, wanted) {
    let nats = null;
    let said = null;
    let retry = null;
    const connect = () => {
      const subjects = [`${this.prefix}description`, `${this.prefix}lite.${wanted}`];
      const take = (subject, payload) => {
        said = null;
        this.take(subject, payload);
      };
      nats = new Nats(server, login, subjects, take, (fault) => {
        if (fault !== said) console.error(`receive.mjs: ${server.text}: ${fault}; tries again`); // once, not at every attempt
        said = fault;
        retry = setTimeout(connect, RETRY_MS);
      });
    };
    connect();
    const lines = setInterval(() => this.show(), 1000);
    const end = () => {
      clearInterval(lines);
      if (nats.open) said = "";
      nats.close();
      clearTimeout(retry);
      process.exitCode = [...this.received.values()].some((one) => one.count > 0) ? 0 : 69;
    };
    if (this.options.seconds > 0) setTimeout(end, 1000 * this.options.seconds);
    process.once("SIGINT", end);
    process.once("SIGTERM", end);
  }
}

function readServer(text, ca) {
  const url = new URL(text.includes("://") ? text : `any://${text}`);
  if (!["tls:", "nats:", "any:"].includes(url.protocol) || url.hostname === "") throw new Error(`${text}: expected tls://HOST[:PORT], nats://HOST[:PORT] or HOST[:PORT]`);
  const host = url.hostname.replace(/^\[|\]$/g, "");
  const local = host.startsWith("127.") || host === "localhost" || host === "::1";
  const secure = url.protocol === "tls:" || (url.protocol === "any:" && !local);
  return { text, host, port: Number(url.port || 4222), tls: secure, ca: ca === undefined ? undefined : fs.readFileSync(ca) };
}

function readLogin(path) {
  if (path === undefined) return {};
  const text = fs.readFileSync(path, "utf8").trim();
  const colon = text.indexOf(":");
  return colon < 0 ? { auth_token: text } : { user: text.slice(0, colon), pass: text.slice(colon + 1) };
}

/** A name as a part of a NATS subject: each byte but letters, digits, '-' and '_' as %XX. */
function token(name) {
  const escaped = (byte) => `%${byte.toString(16).toUpperCase().padStart(2, "0")}`;
  return [...Buffer.from(name)].map((byte) => (/[\w-]/.test(String.fromCharCode(byte)) ? String.fromCharCode(byte) : escaped(byte))).join("");
}

function main() {
  const text = { type: "string" };
  const options = { prefix: { ...text, default: "studio" }, subject: text, ca: text, credentials: text, json: { type: "boolean" }, seconds: text };
  const { values, positionals } = parseArgs({ options, allowPositionals: true });
  if (positionals.length !== 1) throw new Error("expected one SERVER");
  const wanted = values.subject === undefined ? "*" : token(values.subject);
  new Program({ ...values, seconds: Number(values.seconds ?? 0) }).run(readServer(positionals[0], values.ca), readLogin(values.credentials), wanted);
}

// Not if a test imports decodeLite.
if (process.argv[1] !== undefined && fs.existsSync(process.argv[1]) && fs.realpathSync(process.argv[1]) === new URL(import.meta.url).pathname) {
  try {
    main();
  } catch (fault) {
    console.error(`receive.mjs: ${fault.message}; the usage is at the top of the file`);
    process.exitCode = 64;
  }
}
