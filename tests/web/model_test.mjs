// The page's reading, arithmetic and judgement, without a browser.

import assert from "node:assert/strict";
import { test } from "node:test";
import { pageModules } from "./bundle.mjs";
import { messages } from "./modules.mjs";
import { SimulatedDaemon } from "./simulated_daemon.mjs";
import { cameraOnRing } from "./simulated_person.mjs";

const [{ splitMessage }, { readServerText }, { WantedTopics }, { CameraView }, { sceneFrame }, { healthReasons, worst }, { History }, { MarkerWatch }, { DataAge },
  { seenVolume, camerasThatSee }, { Coverage }, format, timecode, { readShots, writeShots }, { readFaults }, { Trails }, { sceneSummary }, { qrPath }, { eventText },
  { RecentSnapshots }, { blobUses }, { latencyHistogram }, { readFindings, diskMinutes }, { splitPiece, wholePiece }, { TakeFrames }, { takeQuality, slateText, startedText, readTags },
  { spreadOf, ellipseFromAbove, readSightings, ofSelected, sightingSummary },
  { rectangle, rectangleBetween, describePolygon, readMasks }, { readImport }] =
  await pageModules("feed/message", "feed/server_text", "feed/topics", "model/camera_view", "model/scene_frame", "model/health_report", "model/history",
    "model/marker_watch", "model/data_age", "model/seen_volume", "model/coverage", "model/format", "model/timecode", "model/shot_list", "model/config_faults",
    "view/trails", "model/summary", "model/qr_path", "model/event_text", "model/recent_snapshots",
    "model/blob_use", "model/latency_histogram", "model/preflight", "model/take_piece", "model/take_frames", "model/take_text", "model/sightings", "model/masks", "model/import_report");
const wire = await messages();
const { fromBinary } = await import("./modules.mjs").then(({ protobuf }) => protobuf());
const decode = (name, bytes) => fromBinary(wire.schema(name), bytes);
const near = (actual, expected, tolerance) => actual.forEach((value, i) => assert.ok(Math.abs(value - expected[i]) <= tolerance, `${actual} is not ${expected} within ${tolerance}`));

const bytes = (...values) => new Uint8Array(values).buffer;

test("A message is split into topic and payload", () => {
  const { topic, payload } = splitMessage(bytes(5, 0x65, 0x76, 0x65, 0x6e, 0x74, 1, 2));
  assert.equal(topic, "event");
  assert.deepEqual([...payload], [1, 2]);
});

test("A message that is shorter than it says is refused", () => {
  assert.equal(splitMessage(bytes()), null);
  assert.equal(splitMessage(bytes(9, 0x65)), null);
  assert.equal(splitMessage(bytes(0)).topic, "");
});

test("A text of the server that is not what it should be changes nothing", () => {
  for (const text of ["", "null", "7", "[]", "{", '{"state":7}', '{"answer":[]}', '{"dropped":null}']) {
    assert.deepEqual(Object.keys(readServerText(text)).filter((key) => key === "state"), []);
  }
  const { state } = readServerText('{"state":{"connected":"yes","age_s":"old","role":"king"}}');
  assert.deepEqual(state, { connected: false, age_s: null, endpoint: "", reason: "", role: "unknown", version: "" });
});

test("An answer and the missed messages are read", () => {
  const { answer, dropped } = readServerText('{"answer":{"id":3,"ok":false,"error":{"code":"CODE_INVALID","message":"why"}},"dropped":{"snapshot":12}}');
  assert.deepEqual(answer, { id: 3, ok: false, result: undefined, code: "CODE_INVALID", message: "why" });
  assert.equal(dropped.get("snapshot"), 12);
});

test("A topic is subscribed while at least one part wants it, and a hidden page keeps only the rare ones", async () => {
  let applied = null;
  const topics = new WantedTopics((list) => (applied = list));
  topics.want("event");
  const first = topics.want("snapshot");
  const second = topics.want("snapshot");
  await null;
  assert.deepEqual(applied, ["event", "snapshot"]);
  first();
  first(); // a second end of the same wish does not count
  assert.deepEqual(topics.topics(), ["event", "snapshot"]);
  topics.setHidden(true);
  assert.deepEqual(topics.topics(), ["event"]);
  topics.setHidden(false);
  second();
  assert.deepEqual(topics.topics(), ["event"]);
});

const plainCamera = (fields) => new CameraView({
  name: "c", widthPx: 1000, heightPx: 800, lensKind: 1, fxPx: 500, fyPx: 500, cxPx: 500, cyPx: 400, distortion: [0, 0, 0, 0, 0],
  cameraFromWorldRotation: { x: 0, y: 0, z: 0, w: 1 }, cameraFromWorldTranslationM: { x: 0, y: 0, z: 0 }, ...fields,
});

test("A pinhole camera projects as by hand", () => {
  near(plainCamera().project([0.2, -0.4, 2]), [550, 300], 1e-9);
  // x = 0.1, y = 0.2: r2 = 0.05, radial 1.025, tangential p1: 2 * 0.01 * 0.02 and 0.01 * (0.05 + 0.08)
  near(plainCamera({ distortion: [0.5, 0, 0.01, 0, 0] }).project([0.1, 0.2, 1]), [500 + 500 * (0.1025 + 0.0004), 400 + 500 * (0.205 + 0.0013)], 1e-9);
});

test("A fisheye camera maps the angle to the radius", () => {
  const angle = 0.6;
  near(plainCamera({ lensKind: 2 }).project([Math.sin(angle), 0, Math.cos(angle)]), [500 + 500 * angle, 400], 1e-9);
});

test("A point behind the camera or outside the image has no projection", () => {
  assert.equal(plainCamera().project([0, 0, -1]), null);
  assert.equal(plainCamera().project([5, 0, 1]), null);
});

test("A camera on the ring sees the point at which it looks in the middle, and a ray comes back", () => {
  for (let i = 0; i < 8; i++) {
    const camera = new CameraView(cameraOnRing(i, 8));
    near(camera.project([0, 0, 0.9]), [639.5, 511.5], 1e-6);
    near(camera.centre_m.slice(2), [2.4], 1e-9);
    near(camera.project(camera.unproject(100, 900, 3)), [100, 900], 1e-6);
  }
});

const daemon = new SimulatedDaemon(wire);
const described = decode("Description", daemon.description());
const snapshotAt = (number) => decode("Snapshot", daemon.snapshot(number, 1_700_000_000_000));

test("A snapshot becomes markers, bones and roots", () => {
  const frame = sceneFrame(described, snapshotAt(10), decode("Health", daemon.health(10, 0)));
  assert.equal(frame.markers.filter((marker) => marker.subject === 0 && marker.state === "measured").length, 41);
  assert.equal(frame.markers.filter((marker) => marker.state === "unlabelled").length, 2);
  assert.deepEqual(frame.markers.filter((marker) => marker.state === "missing").map((marker) => marker.index), [2, 3]);
  assert.ok(frame.roots_m[0] && frame.roots_m[1] && frame.roots_m[2] === null);
  assert.ok(frame.bones.filter((bone) => bone.subject === 0).length >= 17);
  assert.ok(frame.bones.every((bone) => [...bone.from_m, ...bone.to_m].every(Number.isFinite)));
});

test("A snapshot that does not fit the description is left out", () => {
  const snapshot = snapshotAt(10);
  snapshot.subjects[0].markers.states.pop();
  snapshot.subjects[1].markers.positionsM.length = 5;
  snapshot.subjects[0].bones.worldPositionsM.length = 4;
  snapshot.subjects.push({ subject: 77, phase: 2 });
  const frame = sceneFrame(described, snapshot, null);
  assert.equal(frame.markers.filter((marker) => marker.subject >= 0).length, 0);
  assert.equal(frame.bones.filter((bone) => bone.subject === 0).length, 0);
});

test("A snapshot of another version of the description has only markers without a label", () => {
  const frame = sceneFrame({ ...described, version: described.version + 1 }, snapshotAt(10), decode("Health", daemon.health(10, 0)));
  assert.deepEqual(frame.markers.map((marker) => marker.state), ["unlabelled", "unlabelled"]);
  assert.deepEqual(frame.bones, []);
  assert.ok(frame.roots_m.every((root) => root === null));
  assert.match(sceneSummary({ ...described, version: described.version + 1 }, snapshotAt(10)), /Anna: searching, 0 of 41 markers measured\./);
});

test("The summary says what the picture shows", () => {
  assert.match(sceneSummary(described, snapshotAt(10)), /^8 of 8 cameras in this set\. Anna: tracking, 41 of 41 markers measured, at .* camera-prop: searching, 0 of 4.* 2 markers without a label\.$/);
  assert.equal(sceneSummary(null, null), "No data yet.");
});

const known = (fields = {}) => ({
  open: true, closedBecause: "", server: { connected: true, age_s: 0, endpoint: "tcp://x", reason: "", role: "operator", version: "1" }, description: described,
  health: null, findings: [{ check: "sets", level: "good", what: "120.0 a second", cure: "" }], silent_s: 0.1, ...fields,
});
const finding = (check, level, what = "is wrong") => ({ check, level, what, cure: "mocapctl doctor" });

test("The minutes of takes that fit on the disk are those of its finding", () => {
  const read = readFindings([{ check: "sets", verdict: "good", what: "" }, { check: "disk", verdict: "warning", what: "room", minutes: 20.4 }]);
  assert.equal(diskMinutes(read), 20.4);
  assert.equal(diskMinutes(readFindings([{ check: "disk", verdict: "good", what: "", minutes: "many" }])), null);
  assert.equal(diskMinutes(null), null);
  assert.equal(format.hoursOrMinutes(119.4), "119\u2009min");
  assert.equal(format.hoursOrMinutes(412), "7\u2009h");
});

test("A healthy daemon has no reason", () => {
  assert.deepEqual(healthReasons(known()), []);
  assert.equal(worst([]), "good");
});

const faults = [
  ["no server", { open: false, closedBecause: "gone" }, "bad", /No connection to mocap-web: gone/],
  ["no daemon", { server: { ...known().server, connected: false, reason: "nothing listens" } }, "bad", /no connection to mocapd at tcp:\/\/x: nothing listens/],
  ["silence", { silent_s: 12 }, "bad", /No data since 12.s/],
  ["no description", { description: null }, "look", /No description/],
  ["no check yet", { findings: null }, "look", /first check/],
  ["finding", { findings: [finding("camera cam3", "bad", "its clock lost PTP")] }, "bad", /^Camera cam3: its clock lost PTP\.$/],
  ["warning", { findings: [finding("disk", "look", "room for 20 minutes of takes")] }, "look", /^Disk: room for 20 minutes/],
  ["poor take", { health: { take: { state: 2, name: "walk_001", quality: 2, reasons: "gaps" } } }, "look", /walk_001: gaps/],
];
for (const [what, fields, level, text] of faults) {
  test(`The light names a planted fault: ${what}`, () => {
    const reasons = healthReasons(known(fields));
    assert.equal(reasons.length, 1, JSON.stringify(reasons));
    assert.equal(reasons[0].level, level);
    assert.match(reasons[0].text, text);
  });
}

test("The worst reason is first", () => {
  const reasons = healthReasons(known({ findings: [finding("disk", "look"), finding("sets", "bad")] }));
  assert.deepEqual(reasons.map((reason) => reason.level), ["bad", "look"]);
  assert.equal(worst(reasons), "bad");
});

test("A take that is recorded is no reason of the light", () => {
  assert.deepEqual(healthReasons(known({ findings: [finding("take", "look", "walk_001 is being recorded")] })), []);
});

test("Findings of the server are read, and nothing else", () => {
  const said = [{ check: "sets", verdict: "bad", what: "none", cure: "mocapctl status" }, { check: "x", verdict: "odd" }, null, 7, "text"];
  assert.deepEqual(readFindings(said), [{ check: "sets", level: "bad", what: "none", cure: "mocapctl status", minutes: null }]);
  assert.deepEqual(readFindings({ message: "no" }), []);
});

function message(kind, at_s, payload) {
  const bytes = Buffer.alloc(13 + payload.length);
  bytes.writeUInt32LE(9 + payload.length, 0);
  bytes.write(kind, 4, "latin1");
  bytes.writeDoubleLE(at_s, 5);
  bytes.set(payload, 13);
  return bytes;
}

test("A piece of a take is split, up to a message that is not whole", () => {
  const whole = Buffer.concat([message("d", 0, [1]), message("s", 0.5, [2, 3]), message("s", 0.6, [4])]);
  const buffer = (bytes) => bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.length);

  const messages = splitPiece(buffer(whole));
  assert.deepEqual(messages.map(({ kind, at_s, payload }) => [kind, at_s, [...payload]]), [["description", 0, [1]], ["snapshot", 0.5, [2, 3]], ["snapshot", 0.6, [4]]]);
  assert.equal(splitPiece(buffer(whole.subarray(0, whole.length - 1))).length, 2);
  assert.deepEqual(splitPiece(buffer(Buffer.from([255, 255, 255, 255, 0, 0]))), []);
});

/** An answer of mocap-web for a take of 10 Hz whose snapshots have 1 MiB. */
function largeAnswer(from_s, seconds) {
  const messages = [message("d", from_s, [7])];
  for (let number = Math.ceil(from_s * 10 - 1e-6); number / 10 < from_s + seconds && messages.length <= 4; number++) {
    messages.push(message("s", number / 10, new Uint8Array(1024 * 1024).fill(number)));
  }
  const whole = Buffer.concat(messages);
  return whole.buffer.slice(whole.byteOffset, whole.byteOffset + whole.length);
}

test("A piece of a large take is asked for until it is whole", async () => {
  const asked = [];
  const load = async (from_s, seconds) => { asked.push([from_s, seconds]); return largeAnswer(from_s, seconds); };

  const messages = await wholePiece(load, 4, 2);

  const snapshots = messages.filter(({ kind }) => kind === "snapshot");
  assert.deepEqual(snapshots.map(({ payload }) => payload[0]), Array.from({ length: 20 }, (_unused, i) => 40 + i));
  assert.deepEqual(asked.slice(0, 2).map(([from_s]) => from_s), [4, 4.3]);
  assert.ok(asked.every(([from_s, seconds]) => Math.abs(from_s + seconds - 6) < 1e-9));
  const one = new Uint8Array(message("s", 4, new Uint8Array(5 * 1024 * 1024))).buffer;
  assert.equal((await wholePiece(async () => one, 4, 2)).length, 1, "an answer without a further snapshot is the last");
});

/** Frames at 10 Hz whose snapshot is their time. */
const frames10 = (from_s) => Array.from({ length: 20 }, (_unused, i) => ({ at_s: from_s + i / 10, snapshot: from_s + i / 10, description: null }));
const settled = () => new Promise((resolve) => setImmediate(resolve));

test("A take shows the newest frame at an instant, and loads what comes next", async () => {
  const asked = [];
  const frames = new TakeFrames(60, async (from_s) => { asked.push(from_s); return frames10(from_s); }, () => {}, assert.fail);
  assert.equal(frames.at(0.25), null);
  assert.equal(frames.isLoaded(0.25), false);
  await settled();

  assert.equal(frames.at(0.25).snapshot, 0.2);
  assert.equal(frames.at(2).snapshot, 2);
  assert.deepEqual(asked, [0, 2, 4]);
  assert.ok(Math.abs(frames.step(0.2, true) - 0.3) < 1e-9);
  assert.ok(Math.abs(frames.step(2, false) - 1.9) < 1e-9);
});

test("A take that is scrubbed keeps a bounded number of pieces", async () => {
  const asked = [];
  const frames = new TakeFrames(1000, async (from_s) => { asked.push(from_s); return frames10(from_s); }, () => {}, assert.fail);
  for (let at_s = 0; at_s < 100; at_s += 2) {
    frames.at(at_s);
    await settled();
  }

  assert.equal(frames.isLoaded(0), false);
  assert.equal(frames.isLoaded(98), true);
  assert.equal(new Set(asked).size, asked.length);
});

test("A piece that cannot come is told once, and does not stop the others", async () => {
  const faults_told = [];
  const frames = new TakeFrames(4, async (from_s) => { if (from_s === 0) throw new Error("the disk is gone"); return frames10(from_s); }, () => {}, (reason) => faults_told.push(reason));
  frames.at(0);
  await settled();

  assert.equal(frames.at(0), null);
  assert.equal(frames.at(2.5).snapshot, 2.5);
  assert.deepEqual(faults_told, ["the disk is gone"]);
});

test("Words about a take", () => {
  assert.deepEqual(takeQuality("good"), { level: "good", text: "good" });
  assert.deepEqual(takeQuality(""), { level: "look", text: "not judged" });
  assert.equal(slateText("walk", 3), "walk 3");
  assert.equal(slateText("", 0), "–");
  assert.equal(startedText("nonsense"), "");
  assert.match(startedText("2026-03-01T12:00:00.123456789Z"), /^2026-03-01 \d\d:\d\d:00$/);
  assert.deepEqual(readTags(" best, two subjects,,"), ["best", "two subjects"]);
});

test("The history is bounded, gives health from a minute before, and begins anew with the daemon", () => {
  const history = new History();
  for (let second = 0; second < 2000; second++) history.addHealth({ atNs: BigInt(second) * 1_000_000_000n, latencies: [], setRateHz: 60 }, second);
  assert.equal(history.samples().at_s.length, 900);
  assert.equal(history.before().atNs, 1939_000_000_000n);
  history.addHealth({ atNs: 5n, latencies: [], setRateHz: 60 }, 2001);
  assert.equal(history.samples().at_s.length, 1);
  for (let i = 0; i < 600; i++) history.addEvent({ sequence: BigInt(i) }, i);
  assert.equal(history.events.length, 500);
  assert.equal(history.events[0].event.sequence, 599n);
});

test("The watch counts label changes and remembers when a marker was measured", () => {
  const watch = new MarkerWatch();
  const snapshot = snapshotAt(10);
  watch.add(snapshot, 100);
  snapshot.subjects[0].markers.trackIdsPlusOne[5] = 4711;
  snapshot.subjects[0].markers.states[6] = 1;
  watch.add(snapshot, 200);
  assert.equal(watch.of(0, 5).labelChanges, 1);
  assert.equal(watch.of(0, 5).seenAt_ms, 200);
  assert.equal(watch.of(0, 6).seenAt_ms, 100);
  assert.equal(watch.of(9, 0), null);
});

test("The age includes the network if the clocks agree, and leaves the clocks' difference out if not", () => {
  const same = new DataAge();
  same.add(1000, 1020);
  assert.equal(same.clocksAgree, true);
  assert.equal(same.age_s(1100), 0.1);
  const other = new DataAge();
  other.add(1000, 61_000);
  other.add(1100, 61_180);
  assert.equal(other.clocksAgree, false);
  assert.equal(other.age_s(61_200), 0.1);
  assert.equal(new DataAge().age_s(5), null);
});

test("The volume that three cameras see contains the middle, is closed, and is empty for two cameras", () => {
  const cameras = Array.from({ length: 8 }, (_unused, i) => new CameraView(cameraOnRing(i, 8)));
  const { faces, volume_m3 } = seenVolume(cameras);
  assert.equal(camerasThatSee(cameras, [0, 0, 1]), 8);
  // Monte Carlo over the same box: the cells of 0.5 m make a border that is up to a tenth off.
  const box_m = 4.5;
  let seen = 0;
  const kPoints = 20000;
  for (let i = 1; i <= kPoints; i++) {
    const point = [0.7548776662 * i, 0.5698402910 * i, 0.4301597090 * i].map((value) => value % 1); // a low-discrepancy sequence
    if (camerasThatSee(cameras, [(2 * point[0] - 1) * box_m, (2 * point[1] - 1) * box_m, 3 * point[2]]) >= 3) seen++;
  }
  const expected_m3 = (seen / kPoints) * 4 * box_m * box_m * 3;
  assert.ok(Math.abs(volume_m3 - expected_m3) < 0.1 * expected_m3, `${volume_m3} m3, expected about ${expected_m3} m3`);
  // The faces of a closed surface cancel along each axis: as many look one way as the other.
  for (const axis of [0, 1, 2]) assert.equal(faces.filter((face) => face.every((corner) => corner[axis] === face[0][axis])).length % 2, 0);
  assert.equal(seenVolume(cameras.slice(0, 2)).faces.length, 0);
});

test("Coverage counts the cell of each marker", () => {
  const camera = new CameraView(cameraOnRing(0, 8));
  const coverage = new Coverage();
  coverage.add([camera], [[0, 0, 0.9], [0, 0, 0.9], camera.unproject(5, 5, 2), [0, 0, 90]]);
  const cells = coverage.of(camera.name);
  assert.equal(cells.reduce((all, count) => all + count, 0), 3);
  assert.equal(cells[0], 1);
  assert.equal(coverage.share(camera.name), 2 / 192);
  coverage.clear();
  assert.equal(coverage.share(camera.name), 0);
});

test("Trails are bounded, and a jump of a label is not a path", () => {
  const trails = new Trails();
  const marker = (x) => [{ subject: 0, index: 0, state: "measured", at_m: [x, 0, 0] }];
  for (let i = 0; i < 200; i++) trails.add(marker(0.001 * i), i);
  assert.equal([...trails.all()][0].points_m.length, 40);
  trails.add(marker(5), 201);
  assert.equal([...trails.all()][0].points_m.length, 1);
  trails.add([], 5000);
  assert.equal([...trails.all()].length, 0);
});

test("Unknown numbers are a dash, not 0", () => {
  assert.equal(format.fixed(undefined, 1, "ms"), "–");
  assert.equal(format.fixed(NaN, 1), "–");
  assert.equal(format.count(null), "–");
  assert.equal(format.age(null), "–");
});

test("Ages, durations and sizes read as people say them", () => {
  assert.deepEqual([0.0042, 3.21, 12.4, 600].map(format.age), ["4\u2009ms", "3.2\u2009s", "12\u2009s", "10\u2009min"]);
  assert.deepEqual([0, 61.9, 3723].map(format.duration), ["00:00", "01:01", "1:02:03"]);
  assert.deepEqual([812, 2280, 4_100_000].map(format.compact), ["812", "2.3k", "4.1M"]);
  assert.deepEqual([4200n, 5_300_000n, 7_800_000_000n].map(format.bytes), ["4\u2009kB", "5.3\u2009MB", "7.80\u2009GB"]);
});

test("The header shows timecode if there is one, else UTC of the exposure", () => {
  assert.deepEqual(timecode.shownTime({ timecode: { hours: 1, minutes: 2, seconds: 3, frames: 4, framesPerSecond: 30, dropFrame: true } }), { text: "01:02:03;04", source: "TC 30" });
  assert.deepEqual(timecode.shownTime(snapshotAt(10)), { text: "22:13:19.99", source: "UTC" });
  assert.equal(timecode.shownTime(null).source, "no time");
});

test("A shot list is read from a spreadsheet and comes back", () => {
  const shots = readShots("walk1\twalk\tslow, then fast\t12.5\r\n\r\n  \nrun1;run;to the door\njump");
  assert.deepEqual(shots, [
    { name: "walk1", slate: "walk", notes: "slow, then fast", seconds: 12.5, done: false }, { name: "run1", slate: "run", notes: "to the door", seconds: 0, done: false },
    { name: "jump", slate: "", notes: "", seconds: 0, done: false },
  ]);
  assert.deepEqual(readShots(writeShots(shots)), shots);
  assert.equal(readShots("x\n".repeat(5000)).length, 500);
});

test("A shot that was taken stays taken when the list is edited", () => {
  const before = [{ name: "walk1", slate: "walk", notes: "", seconds: 0, done: true }];

  assert.deepEqual(readShots("walk1\twalk\tagain\njump", before).map(({ name, done }) => [name, done]), [["walk1", true], ["jump", false]]);
});

test("Faults of a configuration are read with file, line and column", () => {
  const faults_read = readFaults("the configuration has 2 faults\nconfig/a b.toml:14:15: camera 'x': exposure_us is 25000, expected 10 to 20000\nm.toml:8:1: unknown key");
  assert.deepEqual(faults_read.map(({ file, line, column }) => [file, line, column]), [["config/a b.toml", 14, 15], ["m.toml", 8, 1]]);
});

test("A QR code has its three finders", () => {
  const { path, size } = qrPath("https://example.org/#/monitor");
  for (const corner of [`M4 4h`, `M${size - 5} 4h`, `M4 ${size - 5}h`]) assert.ok(path.includes(corner), corner);
});

test("An event names its subject or camera", () => {
  assert.equal(eventText({ kind: 1, subject: 0, message: "" }, described), "Anna");
  assert.equal(eventText({ kind: 4, camera: 1, message: "no image for 500 ms" }, described), "cam2: no image for 500 ms");
  assert.equal(eventText({ kind: 4, camera: 99, message: "x" }, described), "x");
});

test("The snapshot nearest to an image is found, and none that is too far", () => {
  const recent = new RecentSnapshots();
  for (let i = 0; i < 100; i++) recent.add({ number: BigInt(i), instants: { exposedAtNs: BigInt(i) * 16_000_000n } });
  const { snapshot, apart_ms } = recent.near(90n * 16_000_000n + 2_000_000n);
  assert.equal(snapshot.number, 90n);
  assert.equal(apart_ms, 2);
  assert.equal(recent.near(10n * 16_000_000n), null);
  assert.equal(new RecentSnapshots().near(0n), null);
});

test("A blob at a projected marker is used, another one is not, and without set or calibration the page does not claim to know", () => {
  const camera = new CameraView(cameraOnRing(0, 8));
  const frame = sceneFrame(described, snapshotAt(10), null);
  const [u, v] = camera.project(frame.markers[0].at_m);
  const blobs = { x_px: [u + 1, 3], y_px: [v - 1, 3] };
  assert.deepEqual(blobUses(blobs, camera, frame), ["used", "unused"]);
  const moved = { x_px: [u + 10], y_px: [v] };
  const alone = { ...frame, markers: frame.markers.slice(0, 1) };
  assert.deepEqual(blobUses(moved, camera, alone), ["unused"]);
  assert.deepEqual(blobUses(moved, camera, alone, 15), ["used"]);
  assert.deepEqual(blobUses(blobs, camera, null), ["unknown", "unknown"]);
  assert.deepEqual(blobUses(blobs, plainCamera({ fxPx: 0 }), frame), ["uncalibrated", "uncalibrated"]);
});

test("A histogram is of the time between two messages of health", () => {
  const at = (counts) => ({ latencyBoundsS: [0.001, 0.01], latencyTotals: [{ stage: 5, counts, sumS: 0 }] });
  const shares = (now, before) => latencyHistogram(now, before, 5).map(({ share }) => share);
  assert.deepEqual(shares(at([5n, 20n, 5n]), at([5n, 5n, 0n])), [0, 0.75, 0.25]);
  assert.deepEqual(latencyHistogram(at([1n, 1n, 0n]), null, 5).map(({ to_ms }) => to_ms), [1, 10, Infinity]);
  assert.deepEqual(shares(at([1n]), null), []);
  assert.deepEqual(shares({ latencyBoundsS: [], latencyTotals: [] }, null), []);
});

// L L^T = [4 2 0; 2 5 3; 0 3 10], worked out by hand.
test("A covariance is factorised, and one that is none has no ellipsoid", () => {
  const [a, b, c] = spreadOf([4, 2, 0, 5, 3, 10]);
  near([...a, ...b, ...c], [2, 1, 0, 0, 2, 1.5, 0, 0, Math.sqrt(7.75)], 1e-12);
  for (const broken of [[1, 2, 0, 1, 0, 1], [0, 0, 0, 1, 0, 1], [NaN, 0, 0, 1, 0, 1], [-1, 0, 0, 1, 0, 1], [1, 0, 0, 1, 0, Infinity]]) assert.equal(spreadOf(broken), null);
});

test("A covariance is an ellipse on the map, whose up is x and whose left is y", () => {
  const along = (xx, xy, yy) => ellipseFromAbove(spreadOf([xx, xy, 0, yy, 0, 1]));
  near(Object.values(along(9, 0, 1)), [3, 1, Math.PI / 2], 1e-9); // up
  near(Object.values(along(1, 0, 9)), [3, 1, 0], 1e-9); // to the left, which is the line to the right
  near(Object.values(along(2, 1, 2)), [Math.sqrt(3), 1, Math.PI / 4], 1e-9); // up and left: the line to the right and below
});

test("Sightings say which cameras saw a marker", () => {
  const message = decode("Sightings", new Uint8Array((wire.encode("Sightings", {
    subjectsPlusOne: [2, 0], markers: [5, 902], filled: [true, false], positionsM: [1, 2, 3, 4, 5, 6], covariancesM2: [4e-6, 0, 0, 4e-6, 0, 4e-6, 1e-6, 0, 0, 1e-6, 0, 9e-6],
    seenBy: [1n << 63n, 0b101n],
  }))));
  const [labelled, other] = readSightings(message, 64);
  assert.deepEqual([labelled.subject, labelled.index, labelled.filled, labelled.cameras, labelled.at_m], [1, 5, true, [63], [1, 2, 3]]);
  assert.deepEqual([other.subject, other.index, other.cameras], [-1, 901, [0, 2]]);
  assert.deepEqual(readSightings(message, 2)[1].cameras, [0], "a camera that the description does not have");
  assert.deepEqual(ofSelected([labelled, other], { subject: 1, marker: 5 }), [labelled]);
  assert.deepEqual(ofSelected([labelled, other], { subject: 0, marker: 5 }), [labelled, other]);
  assert.equal(sightingSummary([labelled, other]), "3 rays to 2 markers. Standard deviation of a measured position: 3.00\u2009mm in the median, 3.00\u2009mm at most.");
  message.seenBy.pop();
  assert.deepEqual(readSightings(message, 64), [], "columns that do not fit");
});

test("A rectangle that is drawn covers whole pixels of the image", () => {
  assert.deepEqual(rectangleBetween([30.4, 9.6], [10, 20], 640, 480), rectangle(10, 10, 21, 11));
  assert.deepEqual(rectangleBetween([-50, -50], [1000, 1000], 640, 480), [[-0.5, -0.5], [639.5, -0.5], [639.5, 479.5], [-0.5, 479.5]]);
  assert.equal(rectangleBetween([30, 30], [30.2, 90], 640, 480), null);
  assert.equal(rectangleBetween([700, 500], [800, 600], 640, 480), null);
});

test("A mask is described, and one whose columns do not fit is left out", () => {
  assert.equal(describePolygon(rectangle(3, 4, 10, 20)), "rectangle at 3, 4: 10 × 20 px");
  assert.equal(describePolygon([[0, 0], [10, 0], [5, 9]]), "polygon of 3 corners around 5, 3");
  assert.equal(describePolygon([[0, 0], [10, 0], [10, 10], [1, 10]]), "polygon of 4 corners around 5, 5");
  const { drawn, learnt } = readMasks({ drawn: [{ xPx: [1, 2, 3], yPx: [4, 5] }, { xPx: [1, 2, 3], yPx: [4, 5, 6] }], learnt: [{ xPx: [1, 2], yPx: [1, 2] }], undoSteps: 0 });
  assert.deepEqual(drawn, [[[1, 4], [2, 5], [3, 6]]]);
  assert.deepEqual(learnt, []);
});

test("The answer to an import is read, whatever it is", () => {
  for (const nonsense of [null, 7, [], "x"]) assert.deepEqual(readImport(nonsense, 413), { good: false, message: "the server answered with the status 413", warnings: [], found: null });
  const { good, found } = readImport({ code: "CODE_DONE", report: { markers: [{ name: "A", bone: "Hips" }, 3], bones: [{ name: "Hips" }, { name: "Head" }], ghosts: "many", asymmetric: [["A", "B"], 7] } }, 200);
  assert.equal(good, true);
  assert.deepEqual([found.markers, found.bonesWithout, found.unlabelled, found.asymmetric], [["A"], ["Head"], 0, ["A and B"]]);
  assert.equal(readImport({ code: "CODE_DONE", report: null }, 200).found, null);
});
