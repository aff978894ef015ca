// The messages of a daemon with eight cameras, two persons and a prop that nobody finds, at chosen times.

import { readFileSync } from "node:fs";
import { join } from "node:path";
import { here, messages } from "./modules.mjs";
import { cameraOnRing, poseAt, projected, readMarkers, readSkeleton, rotated } from "./simulated_person.mjs";

export const kCameras = 8;
export const kRate_hz = 60;
const SEARCHING = 1, TRACKING = 2, LOST_MARKER = 1, MEASURED = 2, FILLED = 3, STREAMING = 2;

// A drawn room, 320 x 256 px.
const kRoom = readFileSync(join(here, "room.jpg"));

const vector = ([x, y, z]) => ({ x, y, z });

function subject(name, markerSet, skeleton) {
  const bones = readSkeleton(skeleton);
  return { name, markerSet, skeleton, bones, markers: readMarkers(markerSet, bones) };
}

function described(one) {
  return {
    name: one.name, markerSet: one.markerSet, skeleton: one.skeleton,
    bones: one.bones.map((bone) => ({ name: bone.name, ...(bone.parent >= 0 && { parent: bone.parent }), restOffsetM: vector(bone.offset) })),
    markers: one.markers.map((marker) => ({ name: marker.name, bone: marker.bone, offsetM: vector(marker.offset) })),
  };
}

function tracked(one, index, t, centre, ahead_rad) {
  const { places, turns } = poseAt(one.bones, t, centre, ahead_rad);
  const positions = one.markers.map((marker) => rotated(turns[marker.bone], marker.offset).map((value, i) => value + places[marker.bone][i]));
  // A marker is hidden now and then: the third of every seventh second and its neighbour are filled in or lost.
  const state = (i) => (Math.floor(t) % 7 !== 3 ? MEASURED : i === 3 ? FILLED : i === 4 ? LOST_MARKER : MEASURED);
  return {
    subject: index, phase: TRACKING, residualM: 0.0012 + 0.0003 * Math.sin(t),
    markers: {
      states: one.markers.map((_marker, i) => state(i)), positionsM: positions.flat(), cameras: one.markers.map((_marker, i) => 3 + (i % 5)),
      confidencesPercent: one.markers.map(() => 99), trackIdsPlusOne: one.markers.map((_marker, i) => 100 * (index + 1) + i),
      residualsMillipx: one.markers.map((_marker, i) => 90 + 10 * (i % 7)),
    },
    bones: {
      states: one.bones.map(() => MEASURED), worldPositionsM: places.flat(), worldRotationsXyzw: turns.flat(), localRotationsXyzw: turns.flat(),
      confidencesPercent: one.bones.map(() => 97),
    },
  };
}

const kBounds_s = [0.001, 0.002, 0.003, 0.004, 0.005, 0.007, 0.01, 0.02, 0.05];
const kShares = [0, 0.01, 0.3, 0.42, 0.16, 0.06, 0.03, 0.015, 0.004, 0.001];
const latencies = (t) => [[1, 2.4], [2, 0.12], [3, 0.6], [4, 0.14], [5, 3.2]].map(([stage, ms]) => ({
  stage, count: 60n, p50Ns: BigInt(Math.round(1e6 * ms * (1 + 0.1 * Math.sin(t)))), p99Ns: BigInt(Math.round(1e6 * ms * (1.5 + 0.2 * Math.sin(t / 3)))),
  maxNs: BigInt(Math.round(2e6 * ms)),
}));

export class SimulatedDaemon {
  static async create() {
    return new SimulatedDaemon(await messages());
  }

  constructor(wire) {
    this.wire = wire;
    this.subjects = [subject("Anna", "baseline41", "human18"), subject("Ben", "openmocap18", "human18"), subject("camera-prop", "rigid4", "rigid1")];
    /** Changes that a test plants: fields of CameraHealth by camera index, and of Health. */
    this.cameraFaults = new Map();
    this.healthFields = {};
    /** Of the take that is recorded, or null. */
    this.take = null;
    this.takes = 0;
    this.eventSequence = 0n;
    this.version = 1;
    this.timecode = null;
  }

  description() {
    return this.wire.encode("Description", {
      protocol: "mocap.v1", version: this.version, producer: "stand-in 1", sessionId: "0123456789abcdef", nominalRateHz: kRate_hz, protocolRevision: 2,
      cameras: Array.from({ length: kCameras }, (_unused, i) => cameraOnRing(i, kCameras)), subjects: this.subjects.map(described),
    });
  }

  /** `utc_ms`: now. */
  snapshot(number, utc_ms) {
    const t = number / kRate_hz;
    const exposed = BigInt(Math.round((utc_ms - 4) * 1e6));
    const subjects = [tracked(this.subjects[0], 0, t, [0, 0], 0), tracked(this.subjects[1], 1, t, [0, 0], Math.PI)];
    subjects.push({ subject: 2, phase: SEARCHING });
    return this.wire.encode("Snapshot", {
      number: BigInt(number), sequence: BigInt(number), descriptionVersion: this.version, expectedViews: kCameras, utcMinusHostNs: 0n, synchronisation: 1,
      instants: { exposedAtNs: exposed, sentAtNs: exposed + 3_200_000n },
      views: {
        cameras: Array.from({ length: kCameras }, (_unused, i) => i), frameNumbers: Array(kCameras).fill(BigInt(number)), skewsNs: Array(kCameras).fill(1200n),
        blobs: Array.from({ length: kCameras }, (_unused, i) => 44 + i),
      },
      subjects, unlabelled: { trackIdsPlusOne: [901, 902], positionsM: [1.9, -1.2, 0.02, -2.1, 1.4, 0.6], cameras: [2, 2], residualsMillipx: [300, 420] },
      ...(this.timecode && { timecode: this.timecode }),
    });
  }

  /** Every marker of the persons is seen by three to five cameras; its covariance is twice as long upwards as across. */
  sightings(number, utc_ms) {
    const t = number / kRate_hz;
    const persons = [tracked(this.subjects[0], 0, t, [0, 0], 0), tracked(this.subjects[1], 1, t, [0, 0], Math.PI)];
    const seen = persons.flatMap(({ subject, markers }) => markers.states.map((state, marker) => ({
      subject: subject + 1, marker, state, at: markers.positionsM.slice(3 * marker, 3 * marker + 3), cameras: state === MEASURED ? 3 + (marker % 3) : 0,
    }))).filter(({ state }) => state !== LOST_MARKER).concat([{ subject: 0, marker: 901, state: MEASURED, at: [1.9, -1.2, 0.02], cameras: 2 }]);
    return this.wire.encode("Sightings", {
      sequence: BigInt(number), number: BigInt(number), descriptionVersion: this.version, exposedAtNs: BigInt(Math.round((utc_ms - 4) * 1e6)),
      subjectsPlusOne: seen.map(({ subject }) => subject), markers: seen.map(({ marker }) => marker), filled: seen.map(({ state }) => state === FILLED),
      positionsM: seen.flatMap(({ at }) => at), covariancesM2: seen.flatMap(() => [1e-8, 0, 0, 1e-8, 0, 4e-8]),
      seenBy: seen.map(({ marker, cameras }) => Array.from({ length: cameras }, (_unused, i) => 1n << BigInt((marker + 2 * i) % kCameras)).reduce((sum, bit) => sum | bit, 0n)),
    });
  }

  health(number, utc_ms) {
    const t = number / kRate_hz;
    const total = BigInt(number);
    return this.wire.encode("Health", {
      atNs: BigInt(Math.round(utc_ms * 1e6)), utcMinusHostNs: 0n, setRateHz: kRate_hz, sets: total, completeSets: total, sentSnapshots: total, latencies: latencies(t),
      cameras: Array.from({ length: kCameras }, (_unused, i) => ({
        name: `cam${i + 1}`, phase: STREAMING, rateHz: kRate_hz, frames: total, blobs: 44n * total, thresholdGrey: 60, noiseGrey: 1.4, backgroundGrey: 9.5, synchronised: true,
        offsetUs: 3 * i - 10, driftUsS: 0.02 * i, jitterUs: 4 + i, clockUncertaintyUs: 5, bumped: false, rigOffPx: 0.18 + 0.02 * i, rigTurnedRad: 0.0003, rigMovedM: 0.0004,
        clockSource: 1, fusedBlobs: 44n * total, markerBlobs: 42n * total, markerShare: 0.95 - 0.01 * i, ...this.cameraFaults.get(i),
      })),
      latencyBoundsS: kBounds_s, latencyTotals: [1, 2, 3, 4, 5].map((stage) => ({ stage, counts: kShares.map((share) => BigInt(Math.floor(share * number))), sumS: 0.003 * number })),
      feed: { listeners: 2, connections: 7n, disconnections: 5n, subscriptions: 5 },
      searches: [{
        subject: 2, cause: 6, points: 2, stillPoints: 2, markers: 4, explained: 2, missingMarkers: [2, 3], missingPositionsM: [2.1, -1.1, 0.05, 2.2, -1.3, 0.08],
        missingInViewOf: [5, 6], sentence: "camera-prop: 2 of 4 markers are seen; C and D are hidden, fell off or are too dim",
      }],
      ...(this.take && { take: { ...this.take, takes: BigInt(this.takes) } }), ...this.healthFields,
    });
  }

  /** What camera `index` sees at the snapshot `number`: a drawn room the first person's blobs, and two reflections. */
  preview(index, number, utc_ms) {
    const camera = cameraOnRing(index, kCameras);
    const { places, turns } = poseAt(this.subjects[0].bones, number / kRate_hz);
    const points = this.subjects[0].markers.map((marker) => rotated(turns[marker.bone], marker.offset).map((value, i) => value + places[marker.bone][i]));
    const pixels = points.map((point) => projected(camera, point)).concat([[200, 150], [1100, 880]]);
    return this.wire.encode("Preview", {
      sequence: BigInt(number), frameNumber: BigInt(number), exposedAtNs: BigInt(Math.round((utc_ms - 4) * 1e6)), widthPx: camera.widthPx, heightPx: camera.heightPx, step: 4,
      jpeg: kRoom, xPx: pixels.map(([u]) => u), yPx: pixels.map(([, v]) => v), areaPx2: pixels.map(() => 20),
    });
  }

  event(kind, fields, utc_ms) {
    return this.wire.encode("Event", { sequence: this.eventSequence++, atNs: BigInt(Math.round(utc_ms * 1e6)), kind, descriptionVersion: this.version, ...fields });
  }
}
