"""The connection: drains to the newest, connects again by itself, knows why nothing comes."""

import collections
import dataclasses
import struct
import threading
import time

import mocap.v1.description_pb2 as description_pb2
import mocap.v1.health_pb2 as health_pb2
import mocap.v1.snapshot_pb2 as snapshot_pb2
import numpy as np
import zmq
from google.protobuf.message import DecodeError

from . import frame as frames
from .axes import AXES
from .diagnosis import Diagnosis, diagnose

PROTOCOL = "mocap.v1"
MAX_MESSAGE_BYTES = 8 << 20
TRY_ANEW_S = 0.5
STALE_NS = 500_000_000
MECHANISM_MISMATCH = 0x11000002  # ZMQ_PROTOCOL_ERROR_ZMTP_MECHANISM_MISMATCH
EPIPE = 32


@dataclasses.dataclass
class Statistics:
    received: int = 0  # snapshots
    lost: int = 0  # gaps in their sequence
    skipped: int = 0  # came and were not handed out: a newer one was there
    unreadable: int = 0
    restarts: int = 0  # the daemon began anew
    connections: int = 0
    rate_hz: float = 0.0  # over the last 2 s
    age_ms: float = float("nan")  # exposure to hand-out, of the last frame
    age_p50_ms: float = float("nan")  # over the last 2048 frames handed out
    age_p99_ms: float = float("nan")


def _is_local(endpoint):
    return endpoint.startswith(("ipc://", "tcp://127.", "tcp://localhost:", "tcp://[::1]:"))


def _read_keys(keys):
    if keys is None or len(keys) == 3:
        return keys
    words = {}
    for path in keys:
        with open(path, encoding="utf-8") as file:
            words[path] = dict(line.split()[:2] for line in file if len(line.split()) >= 2)
    server, own = keys
    try:
        return words[server]["public"], words[own]["public"], words[own]["secret"]
    except KeyError as missing:
        raise ValueError(f"keys: no line {missing} in {server} or {own}; expected files of mocapctl keys new") from None


def _varints(payload):
    """Number and sequence, the first fields of a snapshot, without parsing the rest."""
    values = {}
    at = 0
    while at < len(payload) and payload[at] in (0x08, 0x10):
        tag = payload[at]
        at += 1
        value = shift = 0
        while at < len(payload):
            value |= (payload[at] & 0x7F) << shift
            shift += 7
            at += 1
            if payload[at - 1] < 0x80:
                break
        values[tag] = value
    return values.get(0x10, 0)


class Client:
    """A feed. Any thread may call; they take turns.

    keep=1 (default): poll gives the newest frame. keep="all": poll gives every frame, oldest first.
    keys: (server's public, our public, our secret), 40 characters of Z85 each; or (server's, ours), files of
    `mocapctl keys new` that hold them.
    """

    def __init__(self, endpoint="tcp://127.0.0.1:5570", axes="mocap", topic="snapshot", keep=1, keys=None):
        if axes not in AXES:
            raise ValueError(f"axes is {axes!r}, expected one of {', '.join(AXES)}")
        if keep not in (1, "all"):
            raise ValueError(f"keep is {keep!r}, expected 1 or 'all'")
        self.endpoint, self.topic = endpoint, topic
        self._axes, self._keep, self._keys = AXES[axes], keep, _read_keys(keys)
        self._local = _is_local(endpoint)
        self._lock = threading.RLock()
        self._context = zmq.Context()
        self._statistics = Statistics()
        self._arrivals = collections.deque(maxlen=1024)
        self._ages_ns = collections.deque(maxlen=2048)
        self._next_sequence = None
        self._try_anew_at = None
        self._shaking_hands = False
        # What diagnosis.diagnose reads.
        self.connected = False
        self.since_ns = time.monotonic_ns()
        self.connections = self.refused = 0
        self.handshake = None
        self.foreign_protocol = None
        self.description = self.health = None
        self.last_frame_ns = None
        self.transit_ns = None
        self.phases = []
        try:
            self._connect()
        except zmq.ZMQError as fault:
            self._context.destroy(linger=0)
            raise ValueError(f"endpoint {endpoint!r}: {fault}; expected tcp://ADDRESS:PORT or ipc://PATH") from fault

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def close(self):
        with self._lock:
            self._context.destroy(linger=0)

    def poll(self):
        """The newest frame that was not handed out yet, or None. Never waits."""
        with self._lock:
            self._watch_link()
            frame = self._drain()
            # Who did not poll for seconds first meets what waited in between.
            while frame is not None and self._keep == 1 and self._age_ns(frame, STALE_NS) > STALE_NS:
                newer = self._drain()
                if newer is None:
                    break
                frame = newer
            return frame

    def wait(self, timeout_s):
        """The same, and waits for it at most so long."""
        limit = time.monotonic() + timeout_s
        while True:
            frame = self.poll()
            left = limit - time.monotonic()
            if frame is not None or left <= 0:
                return frame
            with self._lock:
                self._socket.poll(min(left, 0.1) * 1000)

    def frames(self):
        """Every frame that comes (with keep=1: the newest each time), for ever."""
        while True:
            frame = self.wait(1.0)
            if frame is not None:
                yield frame

    def age_s(self, frame):
        """Exposure to now, or None where the clocks cannot be compared."""
        age = self._age_ns(frame, None)
        return None if age is None else age / 1e9

    def statistics(self):
        with self._lock:
            now = time.monotonic_ns()
            within = [at for at in self._arrivals if now - at <= 2_000_000_000]
            rate = (len(within) - 1) * 1e9 / max(now - within[0], 1) if len(within) > 1 else 0.0
            copy = dataclasses.replace(self._statistics, rate_hz=rate, connections=self.connections)
            if self._ages_ns:
                copy.age_ms = self._ages_ns[-1] / 1e6
                copy.age_p50_ms, copy.age_p99_ms = (float(v) / 1e6 for v in np.percentile(list(self._ages_ns), (50, 99)))
            return copy

    def diagnose(self):
        """(Diagnosis, a sentence that says what helps)."""
        with self._lock:
            self._watch_link()
            return diagnose(self, time.monotonic_ns())

    # The connection

    def _connect(self):
        self._socket = self._context.socket(zmq.SUB)
        for option, value in ((zmq.RCVHWM, 1000 if self._keep == 1 else 0), (zmq.LINGER, 0), (zmq.RECONNECT_IVL, 100),
                              (zmq.RECONNECT_IVL_MAX, 1000), (zmq.HANDSHAKE_IVL, 2000), (zmq.HEARTBEAT_IVL, 1000),
                              (zmq.MAXMSGSIZE, MAX_MESSAGE_BYTES), (zmq.IPV6, int(self.endpoint.startswith("tcp://[")))):
            self._socket.setsockopt(option, value)
        if self._keys is not None:
            server, public, secret = (key.encode() if isinstance(key, str) else key for key in self._keys)
            self._socket.curve_serverkey, self._socket.curve_publickey, self._socket.curve_secretkey = server, public, secret
        for topic in ("description", "health", self.topic):
            self._socket.subscribe(topic.encode() + b"\0")
        self._monitor = self._socket.get_monitor_socket(
            zmq.EVENT_CONNECTED | zmq.EVENT_DISCONNECTED | zmq.EVENT_CLOSED | zmq.EVENT_HANDSHAKE_SUCCEEDED |
            zmq.EVENT_HANDSHAKE_FAILED_NO_DETAIL | zmq.EVENT_HANDSHAKE_FAILED_PROTOCOL | zmq.EVENT_HANDSHAKE_FAILED_AUTH)
        self._socket.connect(self.endpoint)

    def _watch_link(self):
        if self._try_anew_at is not None and time.monotonic() >= self._try_anew_at:
            self._try_anew_at = None
            self._socket.disable_monitor()
            self._monitor.close(linger=0)
            self._socket.close(linger=0)
            self._connect()
        while True:
            try:
                event, _ = self._monitor.recv_multipart(zmq.DONTWAIT)
            except zmq.Again:
                return
            self._note(*struct.unpack("=HI", event[:6]))

    def _failed(self, why, given_up):
        # Who hangs up first decides how much is told: what was told exactly is believed longer.
        if not (why in (Diagnosis.NOT_A_FEED, Diagnosis.SERVER_KEY_WRONG)
                and self.handshake in (Diagnosis.KEY_MISSING, Diagnosis.KEY_REFUSED)):
            self.handshake = why
        self._shaking_hands = False
        if given_up:  # ZeroMQ has; the operator may allow our key yet
            self._try_anew_at = time.monotonic() + TRY_ANEW_S

    def _note(self, event, value):
        if event == zmq.EVENT_CONNECTED:
            self._shaking_hands = True
        elif event == zmq.EVENT_HANDSHAKE_SUCCEEDED:
            self.connected, self.since_ns = True, time.monotonic_ns()
            self.connections += 1
            self.refused, self.handshake, self._shaking_hands = 0, None, False
        elif event == zmq.EVENT_DISCONNECTED:
            self.connected, self.since_ns = False, time.monotonic_ns()
            if self._shaking_hands:
                self._failed(Diagnosis.NOT_A_FEED, True)
        elif event == zmq.EVENT_CLOSED:
            self.refused += 1
            self.handshake = None
        elif event == zmq.EVENT_HANDSHAKE_FAILED_AUTH:
            self._failed(Diagnosis.KEY_REFUSED, True)
        elif event == zmq.EVENT_HANDSHAKE_FAILED_PROTOCOL:
            self._failed(Diagnosis.KEY_MISSING if value == MECHANISM_MISMATCH else Diagnosis.NOT_A_FEED, True)
        elif event == zmq.EVENT_HANDSHAKE_FAILED_NO_DETAIL:
            self._failed(Diagnosis.SERVER_KEY_WRONG if self._keys is not None and value == EPIPE else Diagnosis.NOT_A_FEED, False)

    # The messages

    def _drain(self):
        """Takes what waits; decodes only what is handed out."""
        newest = None
        while True:
            try:
                message = self._socket.recv(zmq.DONTWAIT)
            except zmq.Again:
                break
            topic, _, payload = message.partition(b"\0")
            if topic == self.topic.encode():
                self._count(payload)
                if newest is not None:
                    self._statistics.skipped += 1
                newest = payload
                if self._keep == "all":
                    frame = self._hand_out(newest)
                    if frame is not None:
                        return frame
                    newest = None
            elif topic == b"description":
                # What came before it refers to the old one.
                newest = None if self._take_description(payload) else newest
            elif topic == b"health":
                self._take_health(payload)
            else:
                self._statistics.unreadable += 1
        return None if newest is None else self._hand_out(newest)

    def _count(self, payload):
        sequence = _varints(payload)
        if self._next_sequence is not None:
            if sequence >= self._next_sequence:
                self._statistics.lost += sequence - self._next_sequence
            else:
                self._statistics.restarts += 1
        self._next_sequence = sequence + 1
        self._statistics.received += 1
        self._arrivals.append(time.monotonic_ns())

    def _take_description(self, payload):
        """Whether it is another one than before."""
        message = description_pb2.Description()
        try:
            message.ParseFromString(payload)
        except DecodeError:
            self._statistics.unreadable += 1
            return False
        if message.protocol != PROTOCOL:
            self.foreign_protocol, self.description = message.protocol[:40] or "without a name", None
            return True
        self.foreign_protocol = None
        before = self.description
        if before is not None and (before.version, before.session_id) == (message.version, message.session_id):
            return False
        if before is not None and before.session_id != message.session_id:
            self._statistics.restarts += 1
            self._next_sequence = None
        self.description = message
        return True

    def _take_health(self, payload):
        try:
            self.health = health_pb2.Health.FromString(payload)
        except DecodeError:
            self._statistics.unreadable += 1

    def _hand_out(self, payload):
        if self.description is None:
            return None
        try:
            message = snapshot_pb2.Snapshot.FromString(payload)
            if message.description_version != self.description.version:
                return None
            frame = frames.frame_of(message, self.description, self._axes, self._is_same_clock(message))
        except (DecodeError, frames.Unreadable):
            self._statistics.unreadable += 1
            return None
        self.last_frame_ns = time.monotonic_ns()
        self.phases = [subject.phase for subject in frame.subjects.values()]
        if frame.sent_at_ns is not None and frame.utc_minus_host_ns is not None:
            self.transit_ns = time.time_ns() - frame.sent_at_ns - frame.utc_minus_host_ns
        age = self._age_ns(frame, None)
        if age is not None:
            self._ages_ns.append(age)
        return frame

    def _is_same_clock(self, message):
        if not self._local or not message.instants.HasField("sent_at_ns"):
            return False
        return -1_000_000 < time.monotonic_ns() - message.instants.sent_at_ns < 60_000_000_000

    def _age_ns(self, frame, otherwise):
        if frame.same_clock:
            return time.monotonic_ns() - frame.exposed_at_ns
        if frame.utc_minus_host_ns is None:
            return otherwise
        return time.time_ns() - frame.exposed_at_ns - frame.utc_minus_host_ns
