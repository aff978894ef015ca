// The calibration of a simulated daemon: each look finds more samples; a solution is there at once.

const kCells = 64, kNeeded = 300, kSamplesPerLook = 100;

export class SimulatedCalibration {
  constructor(cameras) {
    this.cameras = cameras;
    this.state = "IDLE";
    this.samples = 0;
    /** Whether somebody waves the wand: otherwise the last samples do not come. */
    this.waved = true;
    this.floor = false;
    this.rigs = [];
  }

  static looks = ({ action }) => action === "ACTION_STATUS" || action === "ACTION_LIST";

  /** The members of an answer to a CalibrationRequest, in Protobuf's JSON. */
  answer({ action, name, floor }) {
    if (action === "ACTION_LIST") return { rigs: { rigs: this.rigs } };
    if (action === "ACTION_STATUS" && this.state === "COLLECTING") this.samples = Math.min(this.waved ? kNeeded : kNeeded - kSamplesPerLook, this.samples + kSamplesPerLook);
    if (action === "ACTION_STATUS" && this.floor && this.state === "COLLECTING") this.state = "SOLVED";
    if (action === "ACTION_WAND" || action === "ACTION_FLOOR") Object.assign(this, { state: "COLLECTING", samples: 0, floor: action === "ACTION_FLOOR" });
    if (action === "ACTION_FLOOR") this.isFloorChecked = floor?.method !== "METHOD_MARKERS";  // three markers fit any plane
    if (action === "ACTION_SOLVE") this.state = "SOLVED";
    if (action === "ACTION_CANCEL") this.state = "CANCELLED";
    if (action === "ACTION_APPLY") {
      this.state = "APPLIED";
      this.rigs = [{ name: `2026-03-0${this.rigs.length + 1}T09-30-00Z`, solvedBy: "mocapd", cameras: this.cameras, rmsPx: 0.08 }, ...this.rigs];
      this.use(this.rigs[0].name);
    }
    if (action === "ACTION_RESTORE") this.use(name);
    return action === "ACTION_APPLY" || action === "ACTION_RESTORE" ? {} : { calibration: this.progress() };
  }

  use(name) {
    for (const rig of this.rigs) rig.inForce = rig.name === name;
  }

  floorProgress() {
    const solved = this.state === "SOLVED" || this.state === "APPLIED";
    const result = this.isFloorChecked ? { floorRmsM: 0.0004 } : { issues: ["the floor is not checked: three markers always fit; lay a fourth one"] };
    return { state: `CALIBRATION_STATE_${this.state}`, floor: true, advice: "leave the floor frame still: 2 of 5 s", ...(solved && { result }) };
  }

  progress() {
    if (this.floor) return this.floorProgress();
    const solved = this.state === "SOLVED" || this.state === "APPLIED";
    const complete = this.samples >= kNeeded;
    const cells = Array.from({ length: kCells }, (_, i) => (i < (kCells * this.samples) / kNeeded ? this.samples : 0));
    const figures = solved ? { rmsPx: 0.08, heldoutPx: 0.09, points: "900", positionSigmaM: 0.0004, rotationSigmaRad: 0.0001 } : {};
    const cameras = Array.from({ length: this.cameras }, (_, i) => ({
      name: `cam${i + 1}`, images: "600", samples: String(this.samples), shared: String(this.samples), coverage: Math.min(1, this.samples / kNeeded), cells, connected: true, ...figures,
    }));
    return {
      state: `CALIBRATION_STATE_${this.state}`, complete, minShared: String(kNeeded), cameras: this.state === "IDLE" ? [] : cameras, message: this.state === "CANCELLED" ? "cancelled by an operator" : "",
      advice: complete ? "" : `wave in the common view of cam1 and another camera: ${this.samples} of ${kNeeded} samples`,
      ...(solved && { result: { grade: "good", rmsPx: 0.08, heldoutPx: 0.09, samples: "300", wandM: 0.5001, wandStdM: 0.0003, floorIsGuessed: true, issues: ["cam1 covers 48 % of its image: wave near its border"] } }),
    };
  }
}
