// The JSON texts of the server. A field of the wrong type is ignored, so that no text can stop the page.

export type Role = "viewer" | "operator" | "unknown";

/** What the server knows of the daemon. */
export interface ServerState {
  connected: boolean;
  age_s: number | null;
  endpoint: string;
  reason: string;
  role: Role;
  version: string;
}

export interface Answer {
  id: number;
  ok: boolean;
  result: unknown;
  code: string;
  message: string;
}

export interface ServerText {
  state?: ServerState;
  answer?: Answer;
  /** Messages that this viewer missed, by topic. */
  dropped?: Map<string, number>;
}

type Fields = Record<string, unknown>;

const fieldsOf = (value: unknown): Fields | null => (typeof value === "object" && value !== null ? (value as Fields) : null);
const textOf = (value: unknown): string => (typeof value === "string" ? value : "");
const numberOf = (value: unknown): number | null => (typeof value === "number" && Number.isFinite(value) ? value : null);

function readState(said: Fields): ServerState {
  const role = said.role === "viewer" || said.role === "operator" ? said.role : "unknown";
  return {
    connected: said.connected === true, age_s: numberOf(said.age_s), endpoint: textOf(said.endpoint), reason: textOf(said.reason), role,
    version: textOf(said.version),
  };
}

function readAnswer(said: Fields): Answer {
  const error = fieldsOf(said.error) ?? {};
  return { id: numberOf(said.id) ?? -1, ok: said.ok === true, result: said.result, code: textOf(error.code), message: textOf(error.message) };
}

function readDropped(said: Fields): Map<string, number> {
  const dropped = new Map<string, number>();
  for (const [topic, count] of Object.entries(said)) dropped.set(topic, numberOf(count) ?? 0);
  return dropped;
}

/** Returns an empty object for a text that is not JSON or has none of the known fields. */
export function readServerText(text: string): ServerText {
  let said: Fields | null;
  try {
    said = fieldsOf(JSON.parse(text));
  } catch {
    return {};
  }
  const state = fieldsOf(said?.state);
  const answer = fieldsOf(said?.answer);
  const dropped = fieldsOf(said?.dropped);
  return {
    ...(state && { state: readState(state) }),
    ...(answer && { answer: readAnswer(answer) }),
    ...(dropped && { dropped: readDropped(dropped) }),
  };
}
