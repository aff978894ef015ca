#!/usr/bin/env python3
"""Receives the poses that mocap-relay sends to a NATS server, and prints them. Needs Python 3.9 and its standard library alone.

usage: receive.py SERVER [--prefix PREFIX] [--subject NAME] [--ca FILE] [--credentials FILE] [--json] [--seconds S]

SERVER is tls://HOST[:PORT], nats://HOST[:PORT] or HOST[:PORT], which has TLS beyond this machine. FILE of --credentials has a line
USER:PASSWORD or a token. Without --json, one line a second for each subject: rate, loss, age and position. With --json, one line for each
pose: all bones in the world, m, right-handed, z up.

exit codes: 0 poses came, 64 wrong command line, 69 none came
"""

import argparse
import json
import math
import pathlib
import socket
import ssl
import struct
import sys
import time
import urllib.parse

RETRY_S = 1.0
CONNECT_S = 5.0
SILENCE_S = 15.0  # the server sends pings to a client that is silent; the feed has a message a second
MOST_BYTES = 8 << 20  # of one message


class Refused(Exception):
    """The server refuses this client: a sentence for the operator."""


# ---- Messages of the feed ----

def fields(message):
    """The fields of a Protobuf message: number and value (an integer, or bytes)."""
    at = 0

    def varint():
        nonlocal at
        value = shift = 0
        while True:
            value |= (message[at] & 0x7F) << shift
            at, shift = at + 1, shift + 7
            if message[at - 1] < 0x80:
                return value

    while at < len(message):
        tag = varint()
        if tag & 7 == 0:
            yield tag >> 3, varint()
            continue
        size = {1: 8, 5: 4}.get(tag & 7) or varint()
        yield tag >> 3, message[at:at + size]
        at += size


class Subject:
    """What the description says about a subject: names, parents and rest offsets of the bones."""

    def __init__(self, message):
        self.name, self.bones = "", []
        for number, value in fields(message):
            if number == 1:
                self.name = value.decode()
            elif number == 4:
                self.bones.append(self._bone(value))

    @staticmethod
    def _bone(message):
        name, parent, offset = "", -1, [0.0, 0.0, 0.0]
        for number, value in fields(message):
            if number == 1:
                name = value.decode()
            elif number == 2:
                parent = value
            elif number == 3:
                for axis, bits in fields(value):
                    offset[axis - 1] = struct.unpack("<d", bits)[0]
        return name, parent, offset


def read_description(message):
    """Version and subjects, by name."""
    version, subjects = 0, {}
    for number, value in fields(message):
        if number == 2:
            version = value
        elif number == 8:
            subject = Subject(value)
            subjects[subject.name] = subject
    return version, subjects


def unpack_rotation(bits):
    """x y z w; None: the bone is lost."""
    if bits >> 47:
        return None
    largest = bits >> 45 & 3
    small = [((bits >> 15 * i & 0x7FFF) - 16384) / (16383 * math.sqrt(2)) for i in range(3)]
    squares = sum(value * value for value in small)
    if squares > 1:
        small = [value / math.sqrt(squares) for value in small]
    small.insert(largest, math.sqrt(max(0.0, 1 - squares)))
    return small


class Lite:
    """A message of the topic lite/NAME: see proto/lite/README.md."""

    def __init__(self, message):
        bones, rest = divmod(len(message) - 37, 6)
        if bones < 0 or rest or message[0] != 1 or message[3] + bones > message[2]:
            raise ValueError("no message of a topic lite/NAME")
        _, flags, self.subject_bones, self.first_bone, self.version, self.sequence, self.number, self.exposed_utc_ns = struct.unpack_from(
            "<BBBBIIQq", message)
        self.phase = {2: "tracking", 3: "lost"}.get(flags & 3, "searching")
        self.out_of_range, self.off_rest = bool(flags & 4), bool(flags & 8)
        self.root = [int.from_bytes(message[at:at + 3], "little", signed=True) * 1e-4 for at in (28, 31, 34)]
        self.rotations = [unpack_rotation(int.from_bytes(message[at:at + 6], "little")) for at in range(37, len(message), 6)]


def rotate(q, v):
    x, y, z, w = q
    tx, ty, tz = 2 * (y * v[2] - z * v[1]), 2 * (z * v[0] - x * v[2]), 2 * (x * v[1] - y * v[0])
    return [v[0] + w * tx + y * tz - z * ty, v[1] + w * ty + z * tx - x * tz, v[2] + w * tz + x * ty - y * tx]


def poses(subject, root, rotations):
    """World position and rotation of each bone that has a pose, by name. A bone below a lost one has no position."""
    found = []
    for (_, parent, offset), rotation in zip(subject.bones, rotations):
        above = found[parent] if parent >= 0 else None
        if rotation is None:
            found.append((None, None))
        elif parent < 0:
            found.append((root, rotation))
        elif above[0] is None:
            found.append((None, rotation))
        else:
            found.append(([a + b for a, b in zip(above[0], rotate(above[1], offset))], rotation))
    return {bone[0]: {"position_m": position, "rotation_xyzw": rotation}
            for bone, (position, rotation) in zip(subject.bones, found) if rotation is not None}


# ---- NATS ----

class Nats:
    """A connection to a NATS server that receives subjects. Protocol: https://docs.nats.io/reference/reference-protocols/nats-protocol"""

    def __init__(self, host, port, tls, login, subjects):
        self.socket = socket.create_connection((host, port), timeout=CONNECT_S)
        self.waiting = b""
        info = self._greeting()
        if tls is not None or info.get("tls_required"):
            if not (info.get("tls_required") or info.get("tls_available")):
                raise Refused("the server has no TLS")
            if self.waiting:
                raise Refused("bytes came before TLS, which anybody between may have sent")
            self.socket = (tls or ssl.create_default_context()).wrap_socket(self.socket, server_hostname=host)
        hello = {"verbose": False, "pedantic": False, "tls_required": tls is not None, "lang": "python", "version": "1", "protocol": 1, **login}
        self.socket.sendall(b"CONNECT " + json.dumps(hello).encode() + b"\r\nPING\r\n")
        while (line := self._line()) != b"PONG":
            self._refuse(line)
        for number, subject in enumerate(subjects, 1):
            self.socket.sendall(f"SUB {subject} {number}\r\n".encode())
        self.socket.settimeout(0.2)
        self.heard = time.monotonic()

    def close(self):
        self.socket.close()

    def _more(self):
        data = self.socket.recv(65536)
        if not data:
            raise ConnectionError("the server closed the connection")
        self.waiting += data
        self.heard = time.monotonic()

    def _line(self):
        while b"\r\n" not in self.waiting:
            if len(self.waiting) > 65536:
                raise ConnectionError("this is no NATS server")
            self._more()
        line, self.waiting = self.waiting.split(b"\r\n", 1)
        return line

    def _greeting(self):
        """What the server says about itself, in its first line."""
        line = self._line()
        self._refuse(line)
        word, _, info = line.partition(b" ")
        if word != b"INFO":
            raise ConnectionError("this is no NATS server: it does not begin with INFO")
        return json.loads(info)

    @staticmethod
    def _refuse(line):
        if line.startswith(b"-ERR"):
            raise Refused(f"the server says {line[5:].decode(errors='replace')}")

    def next(self):
        """The next message: subject and payload; None if none came within 0.2 s."""
        while True:
            if b"\r\n" in self.waiting:
                head, rest = self.waiting.split(b"\r\n", 1)
                words = head.split()
                if words and words[0] == b"MSG":
                    size = int(words[-1])
                    if size > MOST_BYTES:
                        raise ConnectionError("a message that is too large")
                    if len(rest) >= size + 2:
                        self.waiting = rest[size + 2:]
                        return words[1].decode(), rest[:size]
                else:
                    self.waiting = rest
                    self._refuse(head)
                    if head == b"PING":
                        self.socket.sendall(b"PONG\r\n")
                    continue
            try:
                self._more()
            except (socket.timeout, ssl.SSLWantReadError):
                if time.monotonic() - self.heard > SILENCE_S:
                    raise ConnectionError(f"nothing came for {SILENCE_S:.0f} s") from None
                return None


def token(name):
    """A name as a part of a NATS subject: each byte but letters, digits, '-' and '_' as %XX."""
    plain = b"abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-_"
    return "".join(chr(byte) if byte in plain else f"%{byte:02X}" for byte in name.encode())


# ---- The program ----

class Received:
    """The messages that were received for one subject: counts, ages, and the newest message."""

    def __init__(self):
        self.parts, self.number, self.next_sequence = {}, None, None
        self.count = self.lost = 0
        self.second = []  # ages of the poses of this second, s
        self.newest = None

    def note(self, sequence):
        """Counts the messages between the last one and this one as lost."""
        if self.next_sequence is not None and sequence > self.next_sequence:
            self.lost += sequence - self.next_sequence
        self.next_sequence = sequence + 1  # a lower one: the daemon started again

    def add(self, lite, subject):
        """Adds the bones of a message. Returns the rotations of all bones if the instant is complete."""
        self.newest = lite
        if lite.number != self.number:
            self.number, self.parts = lite.number, {}
        self.parts[lite.first_bone] = lite.rotations
        rotations = [rotation for first in sorted(self.parts) for rotation in self.parts[first]]
        if len(rotations) != lite.subject_bones or (rotations and len(rotations) != len(subject.bones)):
            return None
        self.count += 1
        self.second.append(time.time() - lite.exposed_utc_ns * 1e-9)
        return rotations


class Program:
    def __init__(self, options):
        self.options, self.prefix = options, f"mocap.{options.prefix}."
        self.wanted = token(options.subject) if options.subject else "*"
        self.version, self.subjects, self.received = None, {}, {}
        self.next_line = time.monotonic() + 1

    def take(self, subject, payload):
        topic = subject[len(self.prefix):]
        if topic == "description":
            self.version, self.subjects = read_description(payload)
            return
        name = urllib.parse.unquote(topic[len("lite."):])
        try:
            lite = Lite(payload)
        except ValueError:
            return  # of another layout
        received = self.received.setdefault(name, Received())
        received.note(lite.sequence)
        known = self.subjects.get(name)
        if known is None or lite.version != self.version:
            return  # the description is about to arrive
        rotations = received.add(lite, known)
        if rotations is not None and self.options.json:
            age_ms = round(received.second[-1] * 1e3, 2)
            print(json.dumps({"subject": name, "number": lite.number, "exposed_at_utc_ns": lite.exposed_utc_ns, "age_ms": age_ms,
                              "lost": received.lost, "phase": lite.phase, "out_of_range": lite.out_of_range, "off_rest": lite.off_rest,
                              "bones": poses(known, lite.root, rotations)}), flush=True)

    def show(self):
        """One line for each subject, once a second."""
        if time.monotonic() < self.next_line:
            return
        self.next_line += 1
        for name, received in self.received.items():
            ages, received.second = sorted(received.second), []
            if self.options.json:
                continue
            if not ages:
                print(f"{name}: silent", flush=True)
                continue
            at = " ".join(f"{value:7.3f}" for value in received.newest.root)
            print(f"{name}: {received.newest.phase}, root {at} m, {len(ages)} Hz, age {1e3 * ages[len(ages) // 2]:.1f} ms, "
                  f"{received.lost} of {received.count + received.lost} lost", flush=True)

    def run(self, connect):
        """Receives until the time is over; connects again by itself."""
        until = time.monotonic() + (self.options.seconds or math.inf)
        said = None
        while time.monotonic() < until:
            nats = None
            try:
                nats = connect([self.prefix + "description", self.prefix + "lite." + self.wanted])
                said = None
                while time.monotonic() < until:
                    message = nats.next()
                    self.show()
                    if message is not None:
                        self.take(*message)
            except (OSError, ValueError, IndexError, struct.error, Refused) as fault:
                if str(fault) != said:  # once, not at every attempt
                    said = str(fault)
                    print(f"receive.py: {self.options.server}: {fault}; tries again", file=sys.stderr, flush=True)
                time.sleep(min(RETRY_S, max(0.0, until - time.monotonic())))
            finally:
                if nats is not None:
                    nats.close()
        return any(received.count for received in self.received.values())


def read_server(text):
    """Host, port, and whether to use TLS."""
    url = urllib.parse.urlsplit(text if "://" in text else "//" + text)
    if url.scheme not in ("", "tls", "nats") or not url.hostname:
        raise ValueError(f"{text}: expected tls://HOST[:PORT], nats://HOST[:PORT] or HOST[:PORT]")
    local = url.hostname.startswith("127.") or url.hostname in ("localhost", "::1")
    return url.hostname, url.port or 4222, url.scheme == "tls" or (url.scheme == "" and not local)


def read_login(path):
    if path is None:
        return {}
    text = pathlib.Path(path).read_text().strip()
    user, colon, password = text.partition(":")
    return {"user": user, "pass": password} if colon else {"auth_token": text}


def main():
    parser = argparse.ArgumentParser(usage=__doc__)
    parser.add_argument("server")
    parser.add_argument("--prefix", default="studio")
    parser.add_argument("--subject")
    parser.add_argument("--ca")
    parser.add_argument("--credentials")
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--seconds", type=float, default=0)
    parser.error = lambda fault: sys.exit(print(f"receive.py: {fault}; see --help", file=sys.stderr) or 64)
    options = parser.parse_args()
    try:
        host, port, tls = read_server(options.server)
        login = read_login(options.credentials)
        context = ssl.create_default_context(cafile=options.ca) if tls else None
    except (OSError, ValueError) as fault:
        print(f"receive.py: {fault}", file=sys.stderr)
        return 64
    try:
        return 0 if Program(options).run(lambda subjects: Nats(host, port, context, login, subjects)) else 69
    except KeyboardInterrupt:
        return 0


if __name__ == "__main__":
    sys.exit(main())
