"""A strict VRPN client, written from the description of the protocol alone: it refuses whatever a receiver might misread."""

import socket
import struct
import time

COOKIE_BYTES = 24
HEADER = struct.Struct(">iiiiiI")  # bytes of header and payload, seconds, microseconds, sender, type, sequence number
SENDER, TYPE, UDP, DISCONNECT = -1, -2, -3, -5
POSE, VELOCITY, PONG, TEXT = ("vrpn_Tracker Pos_Quat", "vrpn_Tracker Velocity", "vrpn_Base pong_message", "vrpn_Base text_message")
MY_PING = 30  # this client's number of the type, which differs from the server's


def message(sender, kind, payload=b""):
    padding = b"\0" * (-len(payload) % 8)
    return HEADER.pack(24 + len(payload), 0, 0, sender, kind, 0) + payload + padding


def name_payload(name):
    return struct.pack(">i", len(name) + 1) + name.encode() + b"\0"


class Report:
    def __init__(self, name, sensor, stamp_us, values):
        self.name, self.sensor, self.stamp_us, self.values = name, sensor, stamp_us, values


class VrpnClient:
    """Connects to a server. `called_back`: asks by UDP and lets the server connect; `udp`: wants the reports by UDP."""

    def __init__(self, port, called_back=False, udp=False, version=b"vrpn: ver. 07.35"):
        self.types, self.senders = {}, {}
        self.poses, self.velocities, self.texts, self.pongs = [], [], [], []
        self.by_udp = 0
        self._stream = b""
        self._numbers = {"tcp": -1, "udp": -1}
        self._socket = self._be_called(port) if called_back else socket.create_connection(("127.0.0.1", port), 30)
        self._socket.settimeout(0.2)
        self._socket.sendall(version + b"  0".ljust(8, b"\0"))
        self._datagrams = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._datagrams.bind(("127.0.0.1", 0))
        self._datagrams.setblocking(False)
        if udp:
            self.send(message(self._datagrams.getsockname()[1], UDP, b"127.0.0.1\0"))
        self._cookie = b""

    def _be_called(self, port):
        with socket.create_server(("127.0.0.1", 0)) as listener, socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as asking:
            listener.settimeout(1)
            for _ in range(60):  # a request may be lost, so clients repeat it
                # The address is wrong on purpose: the server is to use the sender of the datagram.
                asking.sendto(f"192.0.2.1 {listener.getsockname()[1]}\0".encode(), ("127.0.0.1", port))
                try:
                    return listener.accept()[0]
                except TimeoutError:
                    pass
        raise AssertionError("the server does not call back")

    def close(self):
        self._socket.close()
        self._datagrams.close()

    def close_datagrams(self):
        """Ends the UDP port alone. From then on only wait_for_end() may be called."""
        self._datagrams.close()

    def wait_for_end(self, seconds):
        """Returns whether the server closes the connection within the time."""
        limit = time.monotonic() + seconds
        while time.monotonic() < limit:
            try:
                if not self._socket.recv(65536):
                    return True
            except TimeoutError:
                pass
            except ConnectionResetError:
                return True
        return False

    def send(self, data):
        self._socket.sendall(data)

    def want(self, number, name):
        self.send(message(number, SENDER, name_payload(name)))

    def ping(self, number):
        self.send(message(MY_PING, TYPE, name_payload("vrpn_Base ping_message")) + message(number, MY_PING))

    def receive(self, seconds, until=lambda: False):
        """Receives until the condition holds; False: it did not within the time."""
        limit = time.monotonic() + seconds
        while not until():
            if time.monotonic() > limit:
                return False
            try:
                data = self._socket.recv(65536)
                if not data:
                    raise ConnectionError("the server closed the connection")
                self._take(data)
            except TimeoutError:
                pass
            while True:
                try:
                    self._take_datagram(self._datagrams.recv(65536))
                except BlockingIOError:
                    break
        return True

    def _take(self, data):
        if len(self._cookie) < COOKIE_BYTES:
            more = COOKIE_BYTES - len(self._cookie)
            self._cookie, data = self._cookie + data[:more], data[more:]
            if len(self._cookie) < COOKIE_BYTES:
                return
            assert self._cookie[:14] == b"vrpn: ver. 07." and self._cookie[16:19] == b"  0", self._cookie
        self._stream += data
        self._stream = self._messages(self._stream, "tcp")

    def _take_datagram(self, data):
        assert len(data) <= 1472, len(data)
        assert self._messages(data, "udp") == b"", "a datagram has whole messages"
        self.by_udp += 1

    def _messages(self, data, way):
        while len(data) >= HEADER.size:
            length, seconds, microseconds, sender, kind, number = HEADER.unpack_from(data)
            assert 24 <= length <= 64000, length
            padded = 24 + (length - 24 + 7) // 8 * 8
            if len(data) < padded:
                break
            assert data[length:padded] == b"\0" * (padded - length), "the padding is zero"
            assert 0 <= microseconds < 1_000_000, microseconds
            assert number > self._numbers[way], "the sequence numbers grow"
            self._numbers[way] = number
            self._handle(sender, kind, data[24:length], seconds * 1_000_000 + microseconds)
            data = data[padded:]
        return data

    def _handle(self, sender, kind, payload, stamp_us):
        if kind in (SENDER, TYPE):
            (size,) = struct.unpack_from(">i", payload)
            assert size == len(payload) - 4 and 1 < size <= 100 and payload[-1] == 0, payload
            known = self.senders if kind == SENDER else self.types
            assert sender not in known, "described once"
            known[sender] = payload[4:-1].decode()
            return
        assert kind >= 0, f"an unexpected system message {kind}"
        assert kind in self.types and sender in self.senders, "described before its first use"
        name = self.senders[sender]
        if self.types[kind] == POSE:
            assert len(payload) == 64, len(payload)
            sensor, zero, *values = struct.unpack(">ii7d", payload)
            assert zero == 0
            assert abs(sum(v * v for v in values[3:]) - 1) < 1e-5, values
            self.poses.append(Report(name, sensor, stamp_us, values))
        elif self.types[kind] == VELOCITY:
            assert len(payload) == 72, len(payload)
            sensor, zero, *values = struct.unpack(">ii8d", payload)
            assert zero == 0 and values[7] > 0
            assert abs(sum(v * v for v in values[3:7]) - 1) < 1e-5, values
            self.velocities.append(Report(name, sensor, stamp_us, values))
        elif self.types[kind] == PONG:
            assert payload == b""
            self.pongs.append(name)
        else:
            assert self.types[kind] == TEXT, self.types[kind]
            severity, level = struct.unpack_from(">ii", payload)
            assert level == 0 and payload[-1] == 0 and len(payload) <= 8 + 1024
            self.texts.append((severity, payload[8:-1].decode()))
