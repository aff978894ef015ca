import type { JSX } from "preact";
import { fixed } from "../model/format";
import type { Bucket } from "../model/latency_histogram";

/** Bars from the first to the last bucket that has anything, with the upper end of each. */
export function Histogram({ buckets, label }: { buckets: Bucket[]; label: string }): JSX.Element {
  const first = buckets.findIndex((bucket) => bucket.share > 0);
  const last = buckets.length - 1 - [...buckets].reverse().findIndex((bucket) => bucket.share > 0);
  const shown = buckets.slice(Math.max(0, first), last + 1);
  const highest = Math.max(...shown.map((bucket) => bucket.share), 1e-9);
  return (
    <ol class="histogram" aria-label={label}>
      {shown.map((bucket) => (
        <li key={bucket.to_ms}>
          <span class="digits">{Number.isFinite(bucket.to_ms) ? `≤ ${Number(bucket.to_ms.toPrecision(3))}\u2009ms` : "more"}</span>
          <svg viewBox="0 0 100 10" preserveAspectRatio="none" aria-hidden="true"><rect width={(100 * bucket.share) / highest} height="10" /></svg>
          <span class="digits">{fixed(100 * bucket.share, 1, "%")}</span>
        </li>
      ))}
    </ol>
  );
}
