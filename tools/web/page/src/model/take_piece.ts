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
