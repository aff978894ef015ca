// The answer to an import of a C3D file: what was found in it, and what is missing.

export interface ImportReport {
  good: boolean;
  /** Of the daemon, or why the file is refused. */
  message: string;
  /** Sentences of the import. */
  warnings: string[];
  /** Null: the file was refused. */
  found: Found | null;
}

export interface Found {
  markers: string[];
  /** Bones that have no marker; their poses follow from the others. */
  bonesWithout: string[];
  residual_mm: number;
  unknown: string[];
  twice: string[];
  neverSeen: number;
  unlabelled: number;
  modelOutputs: number;
  /** Pairs that distinguish left from right. */
  asymmetric: string[];
}

type Fields = Record<string, unknown>;
const isFields = (value: unknown): value is Fields => typeof value === "object" && value !== null && !Array.isArray(value);
const list = (value: unknown): unknown[] => (Array.isArray(value) ? value : []);
const texts = (value: unknown): string[] => list(value).filter((item): item is string => typeof item === "string");
const count = (value: unknown): number => (typeof value === "number" && Number.isFinite(value) ? value : 0);
const names = (value: unknown): string[] => texts(list(value).filter(isFields).map(({ name }) => name));

function readFound(report: unknown): Found | null {
  if (!isFields(report)) return null;
  const used = new Set(texts(list(report.markers).filter(isFields).map(({ bone }) => bone)));
  return {
    markers: names(report.markers), bonesWithout: names(report.bones).filter((bone) => !used.has(bone)), residual_mm: count(report.residual_mm), unknown: texts(report.unknown),
    twice: texts(report.twice), neverSeen: count(report.never_seen), unlabelled: count(report.ghosts), modelOutputs: count(report.model_outputs),
    asymmetric: list(report.asymmetric).map((pair) => texts(pair).join(" and ")).filter((pair) => pair !== ""),
  };
}

/** `answer`: parsed JSON of the server, or anything else. */
export function readImport(answer: unknown, status: number): ImportReport {
  if (!isFields(answer)) return { good: false, message: `the server answered with the status ${status}`, warnings: [], found: null };
  const message = typeof answer.message === "string" ? answer.message : "";
  return { good: answer.code === "CODE_DONE", message, warnings: texts(answer.warnings), found: readFound(answer.report) };
}
