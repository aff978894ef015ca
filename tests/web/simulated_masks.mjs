// The masks of a simulated daemon's cameras.

export class SimulatedMasks {
  constructor() {
    this.learnt = [{ xPx: [1080, 1140, 1140, 1080], yPx: [850, 850, 910, 910] }];
    this.drawn = [];
    this.before = [];
  }

  static lists = (method, { action }) => method === "mask" && action === "ACTION_LIST";

  /** The members of an answer to a MaskRequest, in Protobuf's JSON. */
  answer({ action, camera, polygons = [] }) {
    if (action === "ACTION_LIST") return { masks: { cameras: [{ camera, widthPx: 1280, heightPx: 1024, drawn: this.drawn, learnt: this.learnt, undoSteps: this.before.length }] } };
    if (action === "ACTION_DRAW") {
      this.before.push(this.drawn);
      this.drawn = polygons;
    }
    if (action === "ACTION_UNDO") this.drawn = this.before.pop();
    if (action === "ACTION_FORGET") this.learnt = [];
    return {};
  }
}
