"""A strict decoder of NatNet, written from published facts about the wire and not from the encoder. Every byte of a packet must be read,
every size and count must agree, or it raises Malformed."""

import math
import struct

CONNECT, SERVERINFO, REQUEST, RESPONSE, REQUEST_MODELDEF, MODELDEF, FRAME = 0, 1, 2, 3, 4, 5, 7
DISCONNECT, KEEPALIVE, ECHOREQUEST, ECHORESPONSE, DISCOVERY, UNRECOGNIZED = 9, 10, 12, 13, 14, 100


class Malformed(Exception):
    pass


class Reader:
    def __init__(self, data):
        self.data, self.at = data, 0

    def take(self, layout):
        size = struct.calcsize("<" + layout)
        if self.at + size > len(self.data):
            raise Malformed(f"ends at {len(self.data)}, expected {size} bytes at {self.at}")
        values = struct.unpack_from("<" + layout, self.data, self.at)
        self.at += size
        for value in values:
            if isinstance(value, float) and not math.isfinite(value):
                raise Malformed(f"no finite number at {self.at}")
        return values[0] if len(values) == 1 else values

    def text(self):
        end = self.data.find(b"\0", self.at)
        if end < 0:
            raise Malformed("text without an end")
        word = self.data[self.at:end].decode()
        self.at = end + 1
        return word

    def count(self):
        value = self.take("i")
        if not 0 <= value <= 100_000:
            raise Malformed(f"count {value} at {self.at}")
        return value

    def end(self):
        if self.at != len(self.data):
            raise Malformed(f"{len(self.data) - self.at} bytes too many")


def message(packet):
    """Returns the number of the message and its payload."""
    reader = Reader(packet)
    number, size = reader.take("HH")
    if size != len(packet) - 4:
        raise Malformed(f"header says {size} bytes, packet has {len(packet) - 4}")
    return number, packet[4:]


def server_info(payload):
    reader = Reader(payload)
    name = reader.take("256s").split(b"\0")[0].decode()
    app, version = reader.take("4B"), reader.take("4B")
    ticks, port, multicast, group = reader.take("Q"), reader.take("H"), reader.take("B"), reader.take("4B")
    reader.end()
    return {"name": name, "app": app, "version": version, "ticks": ticks, "port": port, "multicast": multicast, "group": group}


def rigid_body_description(reader, version):
    body = {"name": reader.text(), "id": reader.take("i"), "parent": reader.take("i"), "offset": reader.take("3f")}
    markers = reader.count()
    body["markers"] = [reader.take("3f") for _ in range(markers)]
    body["labels"] = [reader.take("i") for _ in range(markers)]
    if version >= (4, 0):
        body["marker_names"] = [reader.text() for _ in range(markers)]
    return body


def descriptions(payload, version):
    reader = Reader(payload)
    found = {"marker_sets": {}, "bodies": {}, "skeletons": {}}
    for _ in range(reader.count()):
        kind = reader.take("i")
        size = reader.take("i") if version >= (4, 1) else None
        start = reader.at
        if kind == 0:
            name = reader.text()
            found["marker_sets"][name] = [reader.text() for _ in range(reader.count())]
        elif kind == 1:
            body = rigid_body_description(reader, version)
            found["bodies"][body["id"]] = body
        elif kind == 2:
            name, number = reader.text(), reader.take("i")
            bones = [rigid_body_description(reader, version) for _ in range(reader.count())]
            found["skeletons"][number] = {"name": name, "bones": bones}
        else:
            raise Malformed(f"description of kind {kind}")
        if size is not None and reader.at - start != size:
            raise Malformed(f"description of kind {kind} says {size} bytes, has {reader.at - start}")
    reader.end()
    return found


def rigid_body(reader):
    number, position, rotation, error, flags = (reader.take("i"), reader.take("3f"), reader.take("4f"), reader.take("f"), reader.take("h"))
    if abs(sum(v * v for v in rotation) - 1) > 1e-3:
        raise Malformed(f"rotation {rotation}")
    if error < 0:
        raise Malformed(f"error {error}")
    return {"id": number, "position": position, "rotation": rotation, "error": error, "tracked": flags & 1}


def section(reader, version, item):
    count = reader.count()
    size = reader.take("i") if version >= (4, 1) else None
    start = reader.at
    items = [item() for _ in range(count)]
    if size is not None and reader.at - start != size:
        raise Malformed(f"section says {size} bytes, has {reader.at - start}")
    return items


def nothing():
    raise Malformed("a section that must be empty has items")


def frame(payload, version):
    reader = Reader(payload)
    read = {"number": reader.take("i")}
    read["marker_sets"] = dict(section(reader, version, lambda: (reader.text(), [reader.take("3f") for _ in range(reader.count())])))
    read["others"] = section(reader, version, lambda: reader.take("3f"))
    read["bodies"] = {one["id"]: one for one in section(reader, version, lambda: rigid_body(reader))}
    read["skeletons"] = dict(section(reader, version, lambda: (reader.take("i"), [rigid_body(reader) for _ in range(reader.count())])))
    if version >= (4, 1):
        section(reader, version, nothing)
    read["labelled"] = section(reader, version, lambda: dict(zip(("id", "position", "size", "flags", "residual"), (
        reader.take("i"), reader.take("3f"), reader.take("f"), reader.take("h"), reader.take("f")))))
    section(reader, version, nothing)
    section(reader, version, nothing)
    read["timecode"], read["subframe"], read["seconds"] = reader.take("I"), reader.take("I"), reader.take("d")
    read["exposed"], read["received"], read["sent"] = reader.take("QQQ")
    if version >= (4, 0):
        read["ptp"] = reader.take("II")
    read["flags"] = reader.take("h")
    if reader.take("i") != 0:
        raise Malformed("end of the frame is not 0")
    reader.end()
    return read


def packet(number, payload=b"", size=None):
    """A message of a client; `size`: what its header declares."""
    return struct.pack("<HH", number, len(payload) if size is None else size) + payload


def connect_packet(bitstream=None, own=(3, 1), subscribed_only=False):
    """CONNECT as OptiTrack's clients send it: 273 bytes with a version of the bitstream, else 268."""
    payload = b"test".ljust(256, b"\0") + bytes(4) + bytes((*own, 0, 0))
    if bitstream is not None:
        payload += bytes((subscribed_only, *bitstream, 0, 0))
    return packet(CONNECT, payload, 271)
