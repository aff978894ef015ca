// A graph of the last minutes (uPlot). Colours come from the style sheet.

import { useEffect, useRef } from "preact/hooks";
import type { JSX } from "preact";
import uPlot from "uplot";
import { readPalette } from "../view/palette";
import { shownTheme } from "../state/theme";

export interface Line {
  label: string;
  values: (number | null)[];
  dashed?: boolean;
}

const kHeight_px = 180;

const timeText = (at_s: number): string => new Date(1000 * at_s).toLocaleTimeString("en-GB");

function options(width: number, unit: string, lines: Line[]): uPlot.Options {
  const palette = readPalette();
  const axis = { stroke: palette.faint, grid: { stroke: palette.grid, width: 1 }, ticks: { stroke: palette.grid, width: 1 }, font: "11px system-ui, sans-serif" };
  return {
    width, height: kHeight_px, cursor: { drag: { x: false, y: false } }, scales: { y: { range: { min: { pad: 0, hard: 0, soft: 0, mode: 1 }, max: { pad: 0.15, soft: 0, mode: 2 } } } },
    axes: [{ ...axis, values: (_plot, ticks) => ticks.map(timeText) }, { ...axis, size: 60, values: (_plot, ticks) => ticks.map((tick) => `${tick} ${unit}`) }],
    series: [{ value: (_plot, at) => (at === null ? "" : timeText(at)) },
      ...lines.map((line, i) => ({
        label: line.label, stroke: palette.subjects[i], width: 1.5, dash: line.dashed ? [6, 4] : undefined, spanGaps: false, points: { show: false },
        value: (_plot: uPlot, value: number | null) => (value === null ? "–" : `${value.toFixed(2)} ${unit}`),
      }))],
  };
}

export function Graph({ label, unit, at_s, lines }: { label: string; unit: string; at_s: number[]; lines: Line[] }): JSX.Element {
  const box = useRef<HTMLDivElement>(null);
  const plot = useRef<uPlot | null>(null);
  const data = [at_s, ...lines.map((line) => line.values)] as uPlot.AlignedData;
  const theme = shownTheme.value;
  useEffect(() => {
    const element = box.current!;
    const made = new uPlot(options(element.clientWidth, unit, lines), data, element);
    plot.current = made;
    const watch = new ResizeObserver(() => made.setSize({ width: element.clientWidth, height: kHeight_px }));
    watch.observe(element);
    return () => {
      watch.disconnect();
      made.destroy();
      plot.current = null;
    };
  }, [theme]);
  useEffect(() => plot.current?.setData(data), [at_s]);
  return <div class="graph" ref={box} role="img" aria-label={label} />;
}
