"""The connection: returns the newest frame, reconnects automatically, finds out why no data arrives."""

import collections
import dataclasses
import threading
import time

import mocap.v1.description_pb2 as description_pb2
import mocap.v1.event_pb2 as event_pb2
import mocap.v1.health_pb2 as health_pb2
import mocap.v1.snapshot_pb2 as snapshot_pb2
import numpy as np
import zmq
from google.protobuf.message import DecodeError

from . import frame as frames
from .axes import AXES
from .diagnosis import diagnose
from .event import event_of
from .link import Link, read_keys

PROTOCOL = "mocap.v1"
MAX_MESSAGE_BYTES = 8 << 20
MAX_EVENTS = 256  # the newest, for a caller that takes none
STALE_NS = 500_000_000


@dataclasses.dataclass
class Statistics:
    received: int = 0  # snapshots
    lost: int = 0  # gaps in their sequence
    skipped: int = 0  # received but not returned, because a newer frame existed
    unreadable: int = 0
    restarts: int = 0  # restarts of the daemon
    connections: int = 0
    rate_hz: float = 0.0  # over the last 2 s
    age_ms: float = float("nan")  # time from the exposure to the return of the last frame
    age_p50_ms: float = float("nan")  # over the last 2048 returned frames
    age_p99_ms: float = float("nan")


def _is_local(endpoint):
    return endpoint.startswith(("ipc://", "tcp://127.", "tcp://localhost:", "tcp://[::1]:"))


def _varints(payload):
    """The sequence number of a snapshot, read from its first fields without parsing the rest."""
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
    """A connection to a feed. Any thread may call; a lock serialises the calls.

    keep=1 (default): poll returns the newest frame. keep="all": poll returns every frame, oldest first.
    server_key, secret_key, public_key: CURVE keys, each 40 characters of Z85 or a file of `mocapctl keys new`. If
    secret_key is such a file, public_key may be omitted. All omitted: no encryption.
    """

    # keys: the former form of the three keys, a tuple (server_key, public_key, secret_key) or (server_key, secret_key).
    def __init__(self, endpoint="tcp://127.0.0.1:5570", axes="mocap", topic="snapshot", keep=1, keys=None, *,
                 server_key=None, secret_key=None, public_key=None):
        if keys is not None:
            server_key, public_key, secret_key = keys if len(keys) == 3 else (keys[0], None, keys[1])
        if axes not in AXES:
            raise ValueError(f"axes is {axes!r}, expected one of {', '.join(AXES)}")
        if keep not in (1, "all"):
            raise ValueError(f"keep is {keep!r}, expected 1 or 'all'")
        self.endpoint, self.topic = endpoint, topic
        self._axes, self._keep = AXES[axes], keep
        self._local = _is_local(endpoint)
        self._lock = threading.RLock()
        self._statistics = Statistics()
        self._arrivals = collections.deque(maxlen=1024)
        self._ages_ns = collections.deque(maxlen=2048)
        self._next_sequence = None
        self._waiting = collections.deque()  # received snapshots, each with the description before it
        self._newest = None  # the newest received snapshot, and its time of receipt, ns UTC
        self._events = collections.deque(maxlen=MAX_EVENTS)
        self._health = None
        # State that diagnosis.diagnose reads.
        self.foreign_protocol = None
        self.description = None
        self.last_frame_ns = None
        self.phases = []
        options = ((zmq.RCVHWM, 1000 if keep == 1 else 0), (zmq.RECONNECT_IVL, 100), (zmq.RECONNECT_IVL_MAX, 1000),
                   (zmq.HANDSHAKE_IVL, 2000), (zmq.HEARTBEAT_IVL, 1000), (zmq.MAXMSGSIZE, MAX_MESSAGE_BYTES))
        self.link = Link(zmq.SUB, endpoint, read_keys(server_key, secret_key, public_key), options,
                         ("description", "health", "event", topic))

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def close(self):
        with self._lock:
            self.link.close()

    def poll(self):
        """The newest frame that was not returned yet, or None. Never waits."""
        with self._lock:
            frame = self._next_frame()
            # After a pause of the caller the queue contains old frames. Continue until the frame is recent.
            while frame is not None and self._keep == 1 and self._age_ns(frame, STALE_NS) > STALE_NS:
                newer = self._next_frame()
                if newer is None:
                    break
                frame = newer
            return frame

    def events(self):
        """The events (Event) since the last call, oldest first; at most the newest 256. Never waits."""
        with self._lock:
            self._receive()
            events = list(self._events)
            self._events.clear()
            return events

    @property
    def health(self):
        """The newest health report, about once a second: the message mocap.v1.Health with all its fields, or None."""
        with self._lock:
            self._receive()
            return self._health

    def wait(self, timeout_s):
        """Like poll, but waits at most timeout_s seconds for a frame."""
        limit = time.monotonic() + timeout_s
        while True:
            frame = self.poll()
            left = limit - time.monotonic()
            if frame is not None or left <= 0:
                return frame
            with self._lock:
                self.link.socket.poll(min(left, 0.1) * 1000)

    def frames(self):
        """Yields frames endlessly: every frame, or with keep=1 the newest frame each time."""
        while True:
            frame = self.wait(1.0)
            if frame is not None:
                yield frame

    def age_s(self, frame):
        """Time from the exposure to now, or None if the clocks cannot be compared."""
        age = self._age_ns(frame, None)
        return None if age is None else age / 1e9

    def statistics(self):
        with self._lock:
            now = time.monotonic_ns()
            within = [at for at in self._arrivals if now - at <= 2_000_000_000]
            rate = (len(within) - 1) * 1e9 / max(now - within[0], 1) if len(within) > 1 else 0.0
            copy = dataclasses.replace(self._statistics, rate_hz=rate, connections=self.link.connections)
            if self._ages_ns:
                copy.age_ms = self._ages_ns[-1] / 1e6
                copy.age_p50_ms, copy.age_p99_ms = (float(v) / 1e6 for v in np.percentile(list(self._ages_ns), (50, 99)))
            return copy

    def diagnose(self):
        """Returns (Diagnosis, a sentence with the reason and a remedy)."""
        with self._lock:
            self._receive()
            return diagnose(self, time.monotonic_ns())

    def transit_ns(self):
        """Time from the sending to the receipt of the newest snapshot; None if unknown. Older snapshots may have waited for this reader."""
        if self._newest is None:
            return None
        payload, received_at_ns = self._newest
        try:
            message = snapshot_pb2.Snapshot.FromString(payload)
        except DecodeError:
            return None
        if not message.instants.HasField("sent_at_ns") or not message.HasField("utc_minus_host_ns"):
            return None
        return received_at_ns - message.instants.sent_at_ns - message.utc_minus_host_ns

    # The messages

    def _receive(self):
        """Processes all waiting messages. Decodes no snapshot."""
        self.link.watch()
        if self.link.gave_up():
            self.link.open()
        while True:
            try:
                message = self.link.socket.recv(zmq.DONTWAIT)
            except zmq.Again:
                return
            topic, _, payload = message.partition(b"\0")
            if topic == self.topic.encode():
                self._count(payload)
                self._newest = payload, time.time_ns()
                if self._keep == 1 and self._waiting:
                    self._waiting.clear()
                    self._statistics.skipped += 1
                self._waiting.append((payload, self.description))
            elif topic == b"description":
                self._take_description(payload)
            elif topic == b"health":
                self._take_health(payload)
            elif topic == b"event":
                self._take_event(payload)
            else:
                self._statistics.unreadable += 1

    def _next_frame(self):
        """The next readable frame of the received ones."""
        self._receive()
        while self._waiting:
            frame = self._hand_out(*self._waiting.popleft())
            if frame is not None:
                return frame
        return None

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
        message = description_pb2.Description()
        try:
            message.ParseFromString(payload)
        except DecodeError:
            self._statistics.unreadable += 1
            return
        if message.protocol != PROTOCOL:
            self.foreign_protocol, self.description = message.protocol[:40] or "without a name", None
            return
        self.foreign_protocol = None
        before = self.description
        if before is not None and (before.version, before.session_id) == (message.version, message.session_id):
            return
        if before is not None and before.session_id != message.session_id:
            self._statistics.restarts += 1
            self._next_sequence = None
        self.description = message

    def _take_health(self, payload):
        try:
            self._health = health_pb2.Health.FromString(payload)
        except DecodeError:
            self._statistics.unreadable += 1

    def _take_event(self, payload):
        try:
            self._events.append(event_of(event_pb2.Event.FromString(payload), self.description))
        except DecodeError:
            self._statistics.unreadable += 1

    def _hand_out(self, payload, description):
        if description is None:
            return None
        try:
            message = snapshot_pb2.Snapshot.FromString(payload)
            if message.description_version != description.version:
                return None
            frame = frames.frame_of(message, description, self._axes, self._is_same_clock(message))
        except (DecodeError, frames.Unreadable):
            self._statistics.unreadable += 1
            return None
        self.last_frame_ns = time.monotonic_ns()
        self.phases = [subject.phase for subject in frame.subjects.values()]
        age = self._age_ns(frame, None)
        if age is not None:
            self._ages_ns.append(age)
        return frame

    def _is_same_clock(self, message):
        if not self._local or not message.instants.HasField("sent_at_ns"):
            return False
        return -1_000_000 < time.monotonic_ns() - message.instants.sent_at_ns < 60_000_000_000

    def _age_ns(self, frame, otherwise):
        if frame.exposed_at_ns is None:
            return otherwise
        if frame.same_clock:
            return time.monotonic_ns() - frame.exposed_at_ns
        if frame.utc_minus_host_ns is None:
            return otherwise
        return time.time_ns() - frame.exposed_at_ns - frame.utc_minus_host_ns
