// A piece of a take, as mocap-web sends it: descriptions and snapshots with their time.

export interface TakeMessage {
  kind: "description" | "snapshot";
  /** Since the start of the take. */
  at_s: number;
  payload: Uint8Array;
}

const kHead_bytes = 9; // kind and time

/** Each message: length of the rest (4 bytes), kind, time (double), message. Reads up to the first message that is not whole. */
export function splitPiece(piece: ArrayBuffer): TakeMessage[] {
  const view = new DataView(piece);
  const messages: TakeMessage[] = [];
  for (let at = 0; at + 4 + kHead_bytes <= piece.byteLength;) {
    const size = view.getUint32(at, true);
    if (size < kHead_bytes || at + 4 + size > piece.byteLength) break;
    const kind = view.getUint8(at + 4) === 0x64 ? "description" : "snapshot";
    messages.push({ kind, at_s: view.getFloat64(at + 5, true), payload: new Uint8Array(piece, at + 4 + kHead_bytes, size - kHead_bytes) });
    at += 4 + size;
  }
  return messages;
}

/** Of one answer of mocap-web (tools/web/README.md): an answer of this size or more ends before its time does. */
const kMaxAnswer_bytes = 4 * 1024 * 1024;

/** Resolves to the messages of `seconds` from `from_s` on; asks again from the last snapshot while an answer ends early. */
export async function wholePiece(load: (from_s: number, seconds: number) => Promise<ArrayBuffer>, from_s: number, seconds: number): Promise<TakeMessage[]> {
  const messages: TakeMessage[] = [];
  let last_s = -Infinity;
  for (let start_s = from_s; ; start_s = last_s) {
    const answer = await load(start_s, from_s + seconds - start_s);
    const known_s = last_s;
    for (const message of splitPiece(answer)) {
      if (message.kind === "snapshot" && message.at_s <= known_s) continue;
      messages.push(message);
      if (message.kind === "snapshot") last_s = message.at_s;
    }
    if (answer.byteLength < kMaxAnswer_bytes || last_s === known_s || last_s >= from_s + seconds) return messages;
  }
}
