// The snapshots of a take around the instant that is shown. Pieces are loaded when they are needed, the next one ahead.

import type { Description } from "../../gen/mocap/v1/description_pb";
import type { Snapshot } from "../../gen/mocap/v1/snapshot_pb";

export interface TakeFrame {
  at_s: number;
  snapshot: Snapshot;
  description: Description | null;
}

export const kPiece_s = 2;
const kKept = 6;

/** Resolves to the frames from `from_s` on, in order, at most `kPiece_s` long. */
export type LoadFrames = (from_s: number) => Promise<TakeFrame[]>;

export class TakeFrames {
  /** By number of the piece; the last used one is the last. */
  private readonly pieces = new Map<number, TakeFrame[]>();
  private readonly loading = new Set<number>();

  /** `changed` is called when a piece has come, `failed` when one cannot come. */
  constructor(readonly length_s: number, private readonly load: LoadFrames, private readonly changed: () => void, private readonly failed: (reason: string) => void) {}

  /** The newest frame at `at_s`; null: it is not loaded yet, or there is none in its piece. */
  at(at_s: number): TakeFrame | null {
    const number = this.pieceOf(at_s);
    this.want(number);
    this.want(number + 1);
    const frames = this.pieces.get(number) ?? [];
    let low = 0;
    let high = frames.length;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (frames[middle].at_s <= at_s) low = middle + 1;
      else high = middle;
    }
    return frames[low - 1] ?? frames[0] ?? null;
  }

  isLoaded(at_s: number): boolean {
    return this.pieces.has(this.pieceOf(at_s));
  }

  /** The time of the next frame after `at_s`, or of the one before it; `at_s` itself if it is not loaded. */
  step(at_s: number, forward: boolean): number {
    const number = this.pieceOf(at_s);
    const times = [number - 1, number, number + 1].flatMap((each) => (this.pieces.get(each) ?? []).map((frame) => frame.at_s));
    const small_s = 1e-6;
    const found = forward ? times.find((time) => time > at_s + small_s) : times.filter((time) => time < at_s - small_s).pop();
    return found ?? at_s;
  }

  private pieceOf(at_s: number): number {
    return Math.floor(Math.max(0, at_s) / kPiece_s);
  }

  private want(number: number): void {
    const known = this.pieces.get(number);
    if (known) {
      this.pieces.delete(number);
      this.pieces.set(number, known);
    }
    if (known || this.loading.has(number) || number * kPiece_s > this.length_s) return;
    this.loading.add(number);
    this.load(number * kPiece_s).then(
      (frames) => this.keep(number, frames),
      (error) => {
        this.keep(number, []);
        this.failed(error instanceof Error ? error.message : String(error));
      },
    );
  }

  private keep(number: number, frames: TakeFrame[]): void {
    this.loading.delete(number);
    this.pieces.set(number, frames);
    for (const oldest of this.pieces.keys()) {
      if (this.pieces.size <= kKept) break;
      this.pieces.delete(oldest);
    }
    this.changed();
  }
}
