// Colours of canvases, from the style sheet, so that light and dark are defined in one place.

export interface Palette {
  subjects: string[];
  ink: string;
  faint: string;
  grid: string;
  line: string;
  unlabelled: string;
  missing: string;
  used: string;
  unused: string;
  uncalibrated: string;
  bad: string;
  accent: string;
  surface: string;
}

/** The colours in force at `element`. */
export function readPalette(element: Element = document.documentElement): Palette {
  const style = getComputedStyle(element);
  const colour = (name: string) => style.getPropertyValue(`--${name}`).trim() || "#888888";
  return {
    subjects: [1, 2, 3, 4, 5, 6].map((i) => colour(`subject-${i}`)),
    ink: colour("ink"), faint: colour("ink-faint"), grid: colour("grid"), line: colour("line"), unlabelled: colour("unlabelled"), missing: colour("missing"),
    used: colour("used"), unused: colour("unused"), uncalibrated: colour("uncalibrated"), bad: colour("bad"), accent: colour("accent"),
    surface: colour("surface"),
  };
}

export const subjectColour = (palette: Palette, subject: number): string => palette.subjects[Math.max(0, subject) % palette.subjects.length];
