import type { JSX } from "preact";
import type { PageName } from "../state/route";

const paths: Record<PageName | "close" | "help" | "theme" | "copy", string> = {
  stage: "M12 3v8M12 5l-6 3M12 5l6 3M12 11l-4 9M12 11l4 9",
  cameras: "M3 7h12v10H3zM15 10l6-3v10l-6-3",
  subjects: "M12 12a4 4 0 1 0 0-8 4 4 0 0 0 0 8zM4 21c0-4 4-6 8-6s8 2 8 6",
  calibrate: "M12 2v5M12 17v5M2 12h5M17 12h5M12 8a4 4 0 1 0 0 8 4 4 0 0 0 0-8",
  takes: "M3 6h18v14H3zM3 10h18M7 6l3 4M13 6l3 4",
  health: "M2 13h5l2-7 4 13 3-9 2 3h4",
  setup: "M4 7h9M17 7h3M4 17h3M11 17h9M15 4v6M9 14v6",
  monitor: "M3 4h18v12H3zM8 20h8M12 16v4",
  close: "M6 6l12 12M18 6L6 18",
  help: "M9 9a3 3 0 1 1 4 2.8c-.8.4-1 1-1 2.2M12 18v.5",
  theme: "M12 3a9 9 0 1 0 9 9 7 7 0 0 1-9-9z",
  copy: "M9 9h11v11H9zM15 9V4H4v11h5",
};

export function Icon({ name }: { name: keyof typeof paths }): JSX.Element {
  return (
    <svg viewBox="0 0 24 24" fill="none" stroke="currentColor" stroke-width="1.8" stroke-linecap="round" stroke-linejoin="round" aria-hidden="true">
      <path d={paths[name]} />
    </svg>
  );
}
