// Numbers as an operator reads them. "–" stands for unknown, never 0.

export const kUnknown = "–";

export function fixed(value: number | null | undefined, digits: number, unit = ""): string {
  if (value === null || value === undefined || !Number.isFinite(value)) return kUnknown;
  return `${value.toFixed(digits)}${unit && `\u2009${unit}`}`;
}

export function count(value: bigint | number | null | undefined): string {
  return value === null || value === undefined ? kUnknown : value.toLocaleString("en-GB").replace(/,/g, "\u2009");
}

/** "812", "2.3k", "4.1M": for a place that is narrow. */
export function compact(value: number): string {
  if (value < 1000) return String(value);
  return value < 1e6 ? `${(value / 1e3).toFixed(1)}k` : `${(value / 1e6).toFixed(1)}M`;
}

export const milliseconds = (ns: bigint | null | undefined, digits = 1): string =>
  ns === null || ns === undefined ? kUnknown : fixed(Number(ns) / 1e6, digits, "ms");

/** "0.3 s", "12 s", "4 min", "3 h". */
export function age(seconds: number | null | undefined): string {
  if (seconds === null || seconds === undefined || !Number.isFinite(seconds)) return kUnknown;
  if (seconds < 1) return `${Math.max(0, Math.round(seconds * 1000))}\u2009ms`;
  if (seconds < 10) return `${seconds.toFixed(1)}\u2009s`;
  if (seconds < 120) return `${Math.round(seconds)}\u2009s`;
  if (seconds < 7200) return `${Math.round(seconds / 60)}\u2009min`;
  return `${Math.round(seconds / 3600)}\u2009h`;
}

/** "1:02:03" or "02:03". */
export function duration(seconds: number): string {
  const whole = Math.max(0, Math.floor(seconds));
  const pad = (value: number) => String(value).padStart(2, "0");
  const hours = Math.floor(whole / 3600);
  const rest = `${pad(Math.floor(whole / 60) % 60)}:${pad(whole % 60)}`;
  return hours > 0 ? `${hours}:${rest}` : rest;
}

/** "90 min", from two hours on "7 h". */
export const hoursOrMinutes = (minutes: number): string => (minutes < 120 ? `${Math.round(minutes)}\u2009min` : `${Math.round(minutes / 60)}\u2009h`);

export function bytes(value: bigint | number): string {
  const size = Number(value);
  if (size < 1e6) return `${(size / 1e3).toFixed(0)}\u2009kB`;
  if (size < 1e9) return `${(size / 1e6).toFixed(1)}\u2009MB`;
  return `${(size / 1e9).toFixed(2)}\u2009GB`;
}

/** Time of day, UTC, with hundredths. */
export function timeOfDay(utc_ms: number): string {
  return new Date(utc_ms).toISOString().slice(11, 22);
}
