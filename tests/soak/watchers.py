"""What a studio sees of the daemon: subscribers (a process of its own, `watchers.py ENDPOINT COUNT`), a page, a receiver of a
bridge. Each counts what it receives; the subscribers also count what they miss."""

import json
import pathlib
import socket
import subprocess
import sys
import threading
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "system"))
from feed_client import description_pb2, snapshot_pb2, zmq  # noqa: E402
from websocket_client import WebSocket  # noqa: E402


class Seat:
    """One subscriber: its number of messages, and of snapshots that it missed within a session."""

    def __init__(self, context, endpoint):
        self.socket = context.socket(zmq.SUB)
        self.socket.rcvhwm = 0
        for topic in (b"description\0", b"snapshot\0"):
            self.socket.subscribe(topic)
        self.socket.connect(endpoint)
        self.session = self.number = self.payload = None
        self.received = self.missed = 0

    def receive(self):
        topic, payload = self.socket.recv().split(b"\0", 1)
        if topic == b"description":
            session = description_pb2.Description.FromString(payload).session_id
            if session != self.session:
                self.session, self.number = session, None
            return
        number = number_of(payload)
        if self.number is not None and number > self.number:
            self.missed += number - self.number - 1
        self.number, self.payload = number, payload
        self.received += 1


def number_of(payload):
    """Field 1 of a snapshot, which comes first: a varint behind its tag."""
    value = shift = 0
    for byte in payload[1:11] if payload[:1] == b"\x08" else b"":
        value |= (byte & 0x7F) << shift
        shift += 7
        if byte < 0x80:
            break
    return value


def percentile(values, share):
    return sorted(values)[min(len(values) - 1, int(share * len(values)))] if values else None


def watch(endpoint, count):
    """Prints a line of JSON a second."""
    context, poller = zmq.Context(), zmq.Poller()
    seats = {}
    for _ in range(count):
        seat = Seat(context, endpoint)
        seats[seat.socket] = seat
        poller.register(seat.socket, zmq.POLLIN)
    first = next(iter(seats.values()))
    latencies, newest, next_line = [], None, time.monotonic() + 1
    while True:
        for ready, _ in poller.poll(max(0, (next_line - time.monotonic()) * 1000)):
            seat = seats[ready]
            seat.receive()
            if seat is first and seat.payload:
                newest, seat.payload = snapshot_pb2.Snapshot.FromString(seat.payload), None
                latencies.append((time.monotonic_ns() - newest.instants.exposed_at_ns) / 1e6)
        if time.monotonic() < next_line:
            continue
        next_line += 1
        print(json.dumps({
            "received": sum(seat.received for seat in seats.values()), "missed": sum(seat.missed for seat in seats.values()),
            "p50_ms": percentile(latencies, 0.5), "p99_ms": percentile(latencies, 0.99),
            "cameras": len(newest.views.cameras) if newest and latencies else 0,
            "tracking": bool(newest and latencies and newest.subjects and
                             newest.subjects[0].phase == snapshot_pb2.SUBJECT_PHASE_TRACKING)}), flush=True)
        latencies = []


class Subscribers:
    """The process; `line` is its newest line."""

    def __init__(self, endpoint, count):
        self.count, self.line = count, {"received": 0, "missed": 0, "p50_ms": None, "p99_ms": None, "cameras": 0, "tracking": False}
        self.process = subprocess.Popen([sys.executable, "-W", "ignore", __file__, endpoint, str(count)], stdout=subprocess.PIPE)
        threading.Thread(target=self._read, daemon=True).start()

    def _read(self):
        for line in self.process.stdout:
            self.line = json.loads(line)

    def end(self):
        self.process.kill()
        self.process.wait()


class Page:
    """A page that draws each snapshot that it gets, and loads itself again when the connection ends."""

    def __init__(self, port):
        self.drawn, self._port = 0, port
        threading.Thread(target=self._run, daemon=True).start()

    def _run(self):
        while True:
            try:
                page = WebSocket(self._port, timeout_s=5)
                page.send({"subscribe": ["snapshot", "health"]})
                while True:
                    message = page.receive()
                    if isinstance(message, tuple) and message[0] == "snapshot":
                        page.send({"drawn": number_of(message[1])})
                        self.drawn += 1
            except (OSError, IndexError, StopIteration):
                time.sleep(0.5)


class Receiver:
    """Receives what a bridge sends."""

    def __init__(self, port):
        self.packets = 0
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.bind(("127.0.0.1", port))
        threading.Thread(target=self._run, daemon=True).start()

    def _run(self):
        while True:
            self._socket.recv(65536)
            self.packets += 1


if __name__ == "__main__":
    watch(sys.argv[1], int(sys.argv[2]))
