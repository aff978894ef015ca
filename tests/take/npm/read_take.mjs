// Reads a take with MCAP's own library, by its index and as a stream, decodes every message by the schemas in the file,
// and prints what it found as JSON. usage: node read_take.mjs FILE
import { McapIndexedReader, McapStreamReader } from "@mcap/core";
import { open, readFile } from "node:fs/promises";
import * as fzstd from "fzstd";
import lz4 from "lz4js";
import protobuf from "protobufjs";
import "protobufjs/ext/descriptor/index.js";

const path = process.argv[2];
const decompressHandlers = {
  zstd: (bytes) => fzstd.decompress(bytes),
  lz4: (bytes, size) => lz4.decompress(bytes, Number(size)),
};

async function readableOf(file) {
  const size = BigInt((await file.stat()).size);
  return {
    size: async () => size,
    read: async (offset, length) => {
      const bytes = new Uint8Array(Number(length));
      await file.read(bytes, 0, bytes.length, Number(offset));
      return bytes;
    },
  };
}

// Decoders by schema id.
function decoderOf(schema) {
  if (schema.encoding !== "protobuf") throw new Error(`schema ${schema.name} is ${schema.encoding}`);
  const root = protobuf.Root.fromDescriptor(schema.data);
  root.resolveAll();
  return root.lookupType(schema.name);
}

const file = await open(path);
const reader = await McapIndexedReader.Initialize({ readable: await readableOf(file), decompressHandlers });
const types = new Map([...reader.schemasById].map(([id, schema]) => [id, decoderOf(schema)]));
const found = { messages: {}, last: {}, metadata: [], attachments: [], stream: {}, library: reader.header.library };
let before = 0n;
for await (const message of reader.readMessages({ validateCrcs: true })) {
  if (message.logTime < before) throw new Error(`time runs back at ${message.logTime}`);
  before = message.logTime;
  const channel = reader.channelsById.get(message.channelId);
  found.messages[channel.topic] = (found.messages[channel.topic] ?? 0) + 1;
  const type = types.get(channel.schemaId);
  found.last[channel.topic] = type.toObject(type.decode(message.data), { longs: String, enums: String });
}
for await (const metadata of reader.readMetadata()) found.metadata.push(Object.fromEntries(metadata.metadata));
for await (const one of reader.readAttachments({ validateCrcs: true })) {
  found.attachments.push({ name: one.name, mediaType: one.mediaType, text: Buffer.from(one.data).toString() });
}
found.statistics = { messages: Number(reader.statistics.messageCount), chunks: reader.statistics.chunkCount };
await file.close();

const stream = new McapStreamReader({ validateCrcs: true, decompressHandlers });
stream.append(await readFile(path));
for (let record; (record = stream.nextRecord()); ) found.stream[record.type] = (found.stream[record.type] ?? 0) + 1;
found.streamDone = stream.done();
console.log(JSON.stringify(found));
