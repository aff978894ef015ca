"""A subscriber and an operator of a daemon, on its sockets. Skips the test (77) without the Python packages."""

import os
import pathlib
import sys
import threading
import time

from harness import SOURCE

sys.path.insert(0, str(pathlib.Path(os.environ.get("MOCAP_BUILD_DIR", SOURCE / "build/release")) / "python"))
try:
    import zmq
    from mocap.v1 import control_pb2, description_pb2, snapshot_pb2
except ImportError as missing:
    print(f"skipped: {missing}; apt install python3-zmq python3-protobuf")
    sys.exit(77)


DRAIN_S = 5


class Subscriber:
    """Keeps every snapshot of one daemon as its bytes, by number."""

    def __init__(self, endpoint):
        self.snapshots, self.newest, self.description = {}, None, None
        self.undescribed, self.gaps, self._versions = 0, 0, set()
        self._context = zmq.Context()
        self._ends = threading.Event()
        self._thread = threading.Thread(target=self._run, args=(endpoint,), daemon=True)
        self._thread.start()

    def _run(self, endpoint):
        socket = self._context.socket(zmq.SUB)
        socket.linger, socket.rcvhwm = 0, 0
        for topic in (b"description\0", b"snapshot\0"):
            socket.subscribe(topic)
        socket.connect(endpoint)
        while not self._ends.is_set() or (time.monotonic() < self._limit and socket.poll(300)):
            if socket.poll(100):
                self._take(*socket.recv().split(b"\0", 1))
        socket.close()

    def _take(self, topic, payload):
        if topic == b"description":
            self.description = description_pb2.Description.FromString(payload)
            self._versions.add(self.description.version)
            return
        snapshot = snapshot_pb2.Snapshot.FromString(payload)
        self.undescribed += snapshot.description_version not in self._versions
        if self.newest is not None:
            self.gaps += snapshot.number - self.newest.number - 1
        self.snapshots[snapshot.number] = payload
        self.newest = snapshot

    def end(self):
        """Takes what is on its way, and ends. If the daemon still sends: after a few seconds."""
        self._limit = time.monotonic() + DRAIN_S
        self._ends.set()
        self._thread.join()
        self._context.destroy(0)


class Operator:
    """Sends requests, one at a time, and waits for each answer."""

    def __init__(self, endpoint):
        host, port = endpoint.rsplit(":", 1)
        self._context = zmq.Context()
        self._socket = self._context.socket(zmq.DEALER)
        self._socket.linger = 0
        self._socket.connect(f"{host}:{int(port) + 1}")
        self._id = 0

    def order(self, part, timeout_s=60, until=lambda: False, **values):
        """The answer to the request `part` with these values; None after `timeout_s`, or once `until()` holds."""
        self._id += 1
        request = control_pb2.Request(id=self._id)
        message = getattr(request, part)
        message.SetInParent()
        for name, value in values.items():
            if isinstance(value, list):
                getattr(message, name).extend(value)
            else:
                setattr(message, name, value)
        self._socket.send(request.SerializeToString())
        limit = time.monotonic() + timeout_s
        while time.monotonic() < limit and not until():
            if not self._socket.poll(50):
                continue
            answer = control_pb2.Answer.FromString(self._socket.recv())
            if answer.id == self._id:
                return answer
        return None

    def end(self):
        self._context.destroy(0)
