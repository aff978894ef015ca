// A client of Foxglove's own library (@foxglove/ws-protocol), which decodes messages by the schemas that the server sends.
//
// usage: foxglove_client.mjs URL TOPIC...     prints a JSON object {TOPIC: the first message} once each topic has sent one

import { createRequire } from "node:module";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";

const modules = createRequire(join(dirname(fileURLToPath(import.meta.url)), "npm", "package.json"));
const { FoxgloveClient } = modules("@foxglove/ws-protocol");
const { WebSocket } = modules("ws");
const protobuf = modules("protobufjs");
const { FileDescriptorSet } = modules("protobufjs/ext/descriptor");

const [url, ...topics] = process.argv.slice(2);
const client = new FoxgloveClient({ ws: new WebSocket(url, [FoxgloveClient.SUPPORTED_SUBPROTOCOL]) });
const types = new Map();  // by subscription
const received = {};

function decoderOf(channel) {
  const root = protobuf.Root.fromDescriptor(FileDescriptorSet.decode(Buffer.from(channel.schema, "base64")));
  return { topic: channel.topic, type: root.lookupType(channel.schemaName) };
}

client.on("error", (error) => {
  console.error(String(error));
  process.exit(1);
});
client.on("serverInfo", (info) => { received.server = info.name; });
client.on("advertise", (channels) => {
  for (const channel of channels) {
    if (topics.includes(channel.topic)) types.set(client.subscribe(channel.id), decoderOf(channel));
  }
});
client.on("message", ({ subscriptionId, timestamp, data }) => {
  const { topic, type } = types.get(subscriptionId);
  const message = type.decode(new Uint8Array(data.buffer, data.byteOffset, data.byteLength));
  received[topic] ??= { at_ns: String(timestamp), message: type.toObject(message, { longs: String, bytes: String, arrays: true }) };
  if (topics.every((name) => name in received)) {
    console.log(JSON.stringify(received));
    process.exit(0);
  }
});
