"""Reads the messages of a take without its index: an oracle that shares no code with the daemon. A take is an MCAP file
(https://mcap.dev/spec): records of an opcode (1 byte), a length (8 bytes) and a content."""

import dataclasses
import struct
import zlib

import zstandard

MAGIC = b"\x89MCAP0\r\n"
CHANNEL, MESSAGE, CHUNK, FOOTER = 0x04, 0x05, 0x06, 0x02


class Damaged(Exception):
    """The file has bytes that no writer that was killed leaves."""


@dataclasses.dataclass
class TakeMessage:
    topic: str
    sequence: int
    log_time_ns: int
    data: bytes


@dataclasses.dataclass
class TakeFile:
    messages: list
    complete: bool  # the file has its end
    cut_off_bytes: int  # of a record that was not written whole


def _text(content, at):
    (length,) = struct.unpack_from("<I", content, at)
    return content[at + 4:at + 4 + length].decode(), at + 4 + length


def _records(data, at=0):
    """Yields opcode and content of each whole record, then None and the number of bytes behind the last one."""
    while at + 9 <= len(data):
        opcode, length = struct.unpack_from("<BQ", data, at)
        if at + 9 + length > len(data):
            break
        yield opcode, data[at + 9:at + 9 + length]
        at += 9 + length
        if opcode == FOOTER:
            if data[at:] != MAGIC:
                raise Damaged(f"{len(data) - at} bytes behind the end, expected {len(MAGIC)}")
            at = len(data)
    yield None, len(data) - at


def _chunk_records(content):
    _, _, size, crc = struct.unpack_from("<QQQI", content)
    compression, at = _text(content, 28)
    (length,) = struct.unpack_from("<Q", content, at)
    records = content[at + 8:at + 8 + length]
    if compression != "zstd":
        raise Damaged(f"compression is '{compression}', expected zstd")
    try:
        records = zstandard.ZstdDecompressor().decompress(records, max_output_size=size)
    except zstandard.ZstdError as fault:
        raise Damaged(f"a chunk cannot be decompressed: {fault}") from fault
    if len(records) != size or zlib.crc32(records) != crc:
        raise Damaged("a chunk does not match its size or checksum")
    return records


def read_take(path):
    """Fails with Damaged if anything but the end of the file is missing."""
    data = path.read_bytes()
    if not data.startswith(MAGIC):
        if MAGIC.startswith(data):
            return TakeFile([], False, len(data))
        raise Damaged(f"begins with {data[:8]!r}, expected {MAGIC!r}")
    topics, messages, complete = {}, [], False

    def read(opcode, content):
        nonlocal complete
        if opcode == CHANNEL:
            (number,) = struct.unpack_from("<H", content)
            topics[number] = _text(content, 4)[0]
        elif opcode == MESSAGE:
            channel, sequence, log_time_ns = struct.unpack_from("<HIQ", content)
            messages.append(TakeMessage(topics[channel], sequence, log_time_ns, content[22:]))
        elif opcode == CHUNK:
            for inner, inner_content in _records(_chunk_records(content)):
                if inner is not None:
                    read(inner, inner_content)
                elif inner_content != 0:
                    raise Damaged("a chunk ends within a record")
        elif opcode == FOOTER:
            complete = True

    cut_off = 0
    for opcode, content in _records(data, len(MAGIC)):
        if opcode is None:
            cut_off = content
        else:
            read(opcode, content)
    return TakeFile(messages, complete, cut_off)
