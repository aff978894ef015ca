import { useEffect, useMemo, useState } from "preact/hooks";
import type { RefObject } from "preact";
import { useSignalEffect } from "@preact/signals";
import { CameraView } from "../model/camera_view";
import { description } from "../state/live";
import { type Key, addKeys } from "../state/keys";
import { shownTheme } from "../state/theme";

/** The camera models of a description. */
export function useCameras(described = description.value): CameraView[] {
  return useMemo(() => described?.cameras.map((camera) => new CameraView(camera)) ?? [], [described]);
}

/** True while the element is in the visible part of the page. */
export function useSeen(box: RefObject<Element | null>): boolean {
  const [seen, setSeen] = useState(false);
  useEffect(() => {
    if (!box.current) return undefined;
    const watch = new IntersectionObserver((entries) => setSeen(entries[entries.length - 1].isIntersecting), { rootMargin: "40px" });
    watch.observe(box.current);
    return () => watch.disconnect();
  }, []);
  return seen;
}

/** Keys while the part is shown. `keys` must not change. */
export function useKeys(keys: () => Key[]): void {
  useEffect(() => addKeys(keys()), []);
}

/** Calls `recolour` after the theme changed. */
export function useTheme(recolour: () => void): void {
  useSignalEffect(() => {
    shownTheme.value;
    queueMicrotask(recolour);
  });
}
