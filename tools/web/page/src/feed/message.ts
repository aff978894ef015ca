// A binary message of the server: one byte with the length of the topic, the topic in ASCII, and the feed's own Protobuf.

export interface FeedMessage {
  topic: string;
  payload: Uint8Array;
}

/** Returns null if the message is shorter than it says. */
export function splitMessage(data: ArrayBuffer): FeedMessage | null {
  const bytes = new Uint8Array(data);
  if (bytes.length === 0 || bytes.length < 1 + bytes[0]) return null;
  const topic = String.fromCharCode(...bytes.subarray(1, 1 + bytes[0]));
  return { topic, payload: bytes.subarray(1 + bytes[0]) };
}
