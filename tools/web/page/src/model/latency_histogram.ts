// The latency of a stage as a histogram, of the time between two messages of health.

import type { Health, LatencyStage } from "../../gen/mocap/v1/health_pb";

export interface Bucket {
  /** Upper end; Infinity for the last one. */
  to_ms: number;
  share: number;
}

/** Empty if the daemon does not publish it or nothing was measured between the two. */
export function latencyHistogram(now: Health | null, before: Health | null, stage: LatencyStage): Bucket[] {
  const counts = now?.latencyTotals.find((totals) => totals.stage === stage)?.counts;
  if (!now || !counts || counts.length !== now.latencyBoundsS.length + 1) return [];
  const earlier = before === now ? undefined : before?.latencyTotals.find((totals) => totals.stage === stage)?.counts;
  const grown = counts.map((count, i) => Number(count - (earlier && earlier.length === counts.length && earlier[i] <= count ? earlier[i] : 0n)));
  const sum = grown.reduce((all, count) => all + count, 0);
  if (sum === 0) return [];
  return grown.map((count, i) => ({ to_ms: i < now.latencyBoundsS.length ? 1000 * now.latencyBoundsS[i] : Infinity, share: count / sum }));
}
