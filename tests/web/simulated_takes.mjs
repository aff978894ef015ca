// The takes of the machine, as mocap-web serves them over HTTP: a list, notes, pieces, an export and a file.

import { kRate_hz } from "./simulated_daemon.mjs";

const kLength_s = 6;

function framed(kind, at_s, payload) {
  const head = Buffer.alloc(13);
  head.writeUInt32LE(9 + payload.length, 0);
  head.write(kind, 4, "latin1");
  head.writeDoubleLE(at_s, 5);
  return Buffer.concat([head, payload]);
}

export class SimulatedTakes {
  constructor(daemon) {
    this.daemon = daemon;
    this.takes = [
      { name: "walk_002", state: "complete", slate: "walk", number: 2, seconds: kLength_s, bytes: 3_400_000, quality: "good", reasons: "", notes: "the one to use", tags: ["best"], rating: 5, started: "2026-03-01T12:04:00.123456789Z" },
      { name: "walk_001", state: "complete", slate: "walk", number: 1, seconds: 21.5, bytes: 12_100_000, quality: "look", reasons: "Anna: label changes", notes: "", tags: [], rating: null, started: "2026-03-01T12:00:00.5Z" },
      { name: "tryout", state: "cut off", slate: "", number: 0, seconds: 3.25, bytes: 1_800_000, quality: "", reasons: "", notes: "", tags: [], rating: null, started: "" },
    ];
    /** Changes that pages asked for. */
    this.changes = [];
    this.exportLooks = 0;
    this.exportFault = "";
  }

  details(take) {
    const quality = { quality: take.quality, sets: 360, lost_sets: 0, lost_images: 2, residual_px: 0.31, longest_gap_s: 0.12, subjects: [{ name: "Anna", tracked: 99.4, label_changes: 1, residual_mm: 2.1 }] };
    return { ...take, report: { quality, damages: [], info: {} } };
  }

  piece(from_s, seconds) {
    const messages = [framed("d", from_s, this.daemon.description())];
    for (let number = Math.ceil(from_s * kRate_hz); number < (from_s + seconds) * kRate_hz && number <= kLength_s * kRate_hz; number++) {
      messages.push(framed("s", number / kRate_hz, this.daemon.snapshot(number, 1_772_366_640_000 + (1000 * number) / kRate_hz)));
    }
    return Buffer.concat(messages);
  }

  change(take, verb, params) {
    this.changes.push({ name: take.name, verb, params });
    if (verb === "delete") this.takes.splice(this.takes.indexOf(take), 1);
    if (verb === "rename") take.name = params.name;
    if (verb === "edit") Object.assign(take, params);
    return { code: "CODE_DONE", message: `${take.name}: done` };
  }

  exported(take, format) {
    if (this.exportFault) return { state: "failed", progress: 0, fault: this.exportFault, file: "" };
    const share = Math.min(1, this.exportLooks++ / 2);
    return { state: share < 1 ? "running" : "done", progress: share, fault: "", file: `/takes/${take.name}.${format}` };
  }

  /** Status and JSON or bytes; null: not about takes. */
  answer(method, url, body) {
    const file = /^\/takes\/([^/]+)\.(\w+)$/.exec(url.pathname);
    if (file) return [200, Buffer.from(`${file[2]} of ${decodeURIComponent(file[1])}`)];
    const path = /^\/api\/v1\/takes(?:\/([^/]+))?(?:\/(\w+))?$/.exec(url.pathname);
    if (!path) return null;
    if (!path[1]) return [200, { folder: "/var/lib/mocapd/takes", takes: this.takes, left_out: 0 }];
    const take = this.takes.find(({ name }) => name === decodeURIComponent(path[1]));
    if (!take) return [404, { code: "CODE_NOT_FOUND", message: `there is no take '${decodeURIComponent(path[1])}'` }];
    if (method === "POST") return [200, this.change(take, path[2], body)];
    const number = (key) => Number(url.searchParams.get(key));
    if (path[2] === "snapshots") return [200, this.piece(number("from_s"), number("seconds"))];
    if (path[2] === "export") return [200, this.exported(take, url.searchParams.get("format"))];
    if (path[2] === "verify") return [200, { valid: true, faults: [] }];
    return [200, this.details(take)];
  }
}
