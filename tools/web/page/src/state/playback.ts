// One take that is played: the instant that is shown, and the frame of this instant as the source of a 3D view.

import { signal } from "@preact/signals";
import type { Description } from "../../gen/mocap/v1/description_pb";
import type { Snapshot } from "../../gen/mocap/v1/snapshot_pb";
import { TakeFrames } from "../model/take_frames";
import { takeFrames } from "./recorded";
import type { SceneSource } from "./scene_source";

export class Playback implements SceneSource {
  readonly at_s = signal(0);
  readonly playing = signal(false);
  readonly loading = signal(true);
  readonly fault = signal("");
  readonly description = signal<Description | null>(null);
  readonly snapshot = signal<Snapshot | null>(null);
  private readonly listeners = new Set<() => void>();
  private readonly frames: TakeFrames;
  private ended = false;
  private drawnAt_ms = 0;

  constructor(name: string, readonly length_s: number) {
    this.frames = new TakeFrames(length_s, (from_s) => takeFrames(name, from_s), () => this.show(), (reason) => (this.fault.value = reason));
    this.show();
  }

  newest(): Snapshot | null {
    return this.snapshot.peek();
  }

  health(): null {
    return null;
  }

  onFrame(draw: () => void): () => void {
    this.listeners.add(draw);
    return () => void this.listeners.delete(draw);
  }

  seek(at_s: number): void {
    this.at_s.value = Math.min(this.length_s, Math.max(0, at_s));
    this.show();
  }

  step(forward: boolean): void {
    this.playing.value = false;
    this.seek(this.frames.step(this.at_s.peek(), forward));
  }

  toggle(): void {
    if (!this.playing.peek() && this.at_s.peek() >= this.length_s) this.seek(0);
    this.playing.value = !this.playing.peek();
    this.drawnAt_ms = performance.now();
    if (this.playing.peek()) requestAnimationFrame(() => this.advance());
  }

  end(): void {
    this.ended = true;
    this.playing.value = false;
  }

  /** Waits for a piece that is not loaded instead of passing over it. */
  private advance(): void {
    if (this.ended || !this.playing.peek()) return;
    const now = performance.now();
    if (this.frames.isLoaded(this.at_s.peek())) this.seek(this.at_s.peek() + (now - this.drawnAt_ms) / 1000);
    this.drawnAt_ms = now;
    if (this.at_s.peek() >= this.length_s) this.playing.value = false;
    else requestAnimationFrame(() => this.advance());
  }

  private show(): void {
    if (this.ended) return;
    const frame = this.frames.at(this.at_s.peek());
    this.loading.value = !this.frames.isLoaded(this.at_s.peek());
    if (!frame) return;
    if (frame.description && frame.description.version !== this.description.peek()?.version) this.description.value = frame.description;
    this.snapshot.value = frame.snapshot;
    for (const draw of this.listeners) draw();
  }
}
