"""Changes of a running daemon lose nobody: a walking actor is tracked through `subject add`, `mask learn`, a reload with
another threshold and with another camera, in every snapshot and without a gap, and the recording is one file. Runs in
its own network namespace."""

import json
import os
import pathlib
import re
import signal
import sys
import threading
import unittest

from harness import SOURCE, Desk, until

sys.path.insert(0, str(pathlib.Path(os.environ.get("MOCAP_BUILD_DIR", SOURCE / "build/release")) / "python"))
try:
    import zmq
    from mocap.v1 import description_pb2, snapshot_pb2
except ImportError as missing:
    print(f"skipped: {missing}; apt install python3-zmq python3-protobuf")
    sys.exit(77)

CONFIG = """
[capture]
rig = "{folder}/rig.toml"

[publish]
endpoint = "{endpoint}"

[record]
snapshots = "{folder}/take.jsonl"

[detect]
threshold = {threshold}

[[subject]]
name = "actor"
marker_set = "{source}/config/markersets/openmocap18.toml"
"""

CAMERA = """
[[camera]]
name = "cam{number}"
driver = "synthetic"
marker_set = "{source}/config/markersets/openmocap18.toml"
motion = "tpose:4,walk"
rate_hz = 30
exposure_us = {exposure}
"""

TRACKING = snapshot_pb2.SUBJECT_PHASE_TRACKING
LONG_S = 120  # time limit of a failing test


class Listener:
    """One subscriber on one connection; it keeps all messages of the feed in their order."""

    def __init__(self, context, endpoint):
        self.messages = []  # (topic, message)
        self._socket = context.socket(zmq.SUB)
        self._socket.linger = 0
        self._socket.rcvhwm = 0
        for topic in ("description", "snapshot"):
            self._socket.subscribe(topic.encode() + b"\0")
        self._socket.connect(endpoint)
        self._ends = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def _run(self):
        kinds = {b"description": description_pb2.Description, b"snapshot": snapshot_pb2.Snapshot}
        while not self._ends.is_set():
            if not self._socket.poll(100):
                continue
            topic, payload = self._socket.recv().split(b"\0", 1)
            self.messages.append((topic.decode(), kinds[topic].FromString(payload)))
        self._socket.close()

    def of(self, topic):
        return [message for kind, message in self.messages[:] if kind == topic]

    def end(self):
        self._ends.set()
        self._thread.join()


def phase(snapshot, subject=0):
    return snapshot.subjects[subject].phase if subject < len(snapshot.subjects) else None


class Keep(unittest.TestCase):
    def setUp(self):
        self.desk = Desk()
        self.addCleanup(self.desk.close)
        host, port = self.desk.endpoint.rsplit(":", 1)
        self.control = f"{host}:{int(port) + 1}"
        self.desk.write("rig.toml", (SOURCE / "config/demo.rig.toml").read_text())
        self.added = ""
        self.write_config()
        self.daemon = self.desk.start("mocapd", "--config", self.desk.folder / "mocapd.toml")
        context = zmq.Context()
        self.desk.callback(context.destroy, 0)
        self.feed = Listener(context, self.desk.endpoint)
        self.addCleanup(self.feed.end)

    def write_config(self, threshold=60, exposure=500):
        text = CONFIG.format(source=SOURCE, folder=self.desk.folder, endpoint=self.desk.endpoint, threshold=threshold)
        for number in range(1, 5):
            text += CAMERA.format(source=SOURCE, number=number, exposure=exposure if number == 2 else 500)
        self.desk.write("mocapd.toml", text + self.added)

    def ctl(self, *arguments):
        asked = self.desk.run("mocapctl", *arguments, "--endpoint", self.control)
        self.assertEqual(asked.returncode, 0, asked.stderr)
        return asked.stdout

    def newest(self):
        snapshots = self.feed.of("snapshot")
        return snapshots[-1] if snapshots else None

    def version(self):
        newest = self.feed.of("description")[-1]
        return newest.session_id, newest.version

    def walks(self):
        # Marker 0 has moved by more than 0.3 m since the T-pose.
        tracked = [s for s in self.feed.of("snapshot") if phase(s) == TRACKING and s.subjects[0].bones.states]
        if not tracked:
            return False
        first, last = (s.subjects[0].markers.positions_m[:3] for s in (tracked[0], tracked[-1]))
        return sum((a - b) ** 2 for a, b in zip(first, last)) > 0.3 ** 2

    def after_change(self, change, what):
        """Makes a change; returns the snapshots from the last one before it to one second of sets after it."""
        version, begin = self.version(), len(self.feed.of("snapshot")) - 1
        change()
        until(lambda: self.version() != version, f"{what}: another description")
        length = len(self.feed.of("snapshot"))
        until(lambda: len(self.feed.of("snapshot")) > length + 30, f"{what}: snapshots after it")
        snapshots = self.feed.of("snapshot")[begin:]
        self.judge(snapshots, what)
        return snapshots

    def judge(self, snapshots, what):
        lost = [s.number for s in snapshots if phase(s) != TRACKING]
        numbers = [s.number for s in snapshots]
        exposed = [s.instants.exposed_at_ns for s in snapshots]
        gap_ms = max(b - a for a, b in zip(exposed, exposed[1:])) / 1e6
        print(f"{what}: snapshots={len(numbers)} not_tracked={len(lost)} longest_gap_ms={gap_ms:.1f}", flush=True)
        self.assertEqual(lost, [], what)
        self.assertEqual(numbers, sorted(set(numbers)), what)

    def fits(self):
        """Number of fits of the actor so far, by the log."""
        return len(re.findall(r"subject actor: fitted", self.daemon.output()))

    def bodies(self):
        """Number of different bodies of the actor in the descriptions, one after another."""
        actors = [next(s for s in d.subjects if s.name == "actor") for d in self.feed.of("description")]
        shapes = [s.SerializeToString() for s in actors]
        return 1 + sum(a != b for a, b in zip(shapes, shapes[1:]))

    def assert_described_first(self):
        known = set()
        for topic, message in self.feed.messages[:]:
            if topic == "description":
                known.add(message.version)
            else:
                self.assertIn(message.description_version, known)

    def assert_one_whole_recording(self):
        takes = sorted(path.name for path in self.desk.folder.glob("take*"))
        self.assertEqual(takes, ["take.jsonl"])
        lines = [json.loads(line) for line in (self.desk.folder / "take.jsonl").read_text().splitlines()]
        numbers = [int(line.get("number", 0)) for line in lines]
        self.assertEqual(numbers, sorted(set(numbers)))
        names = [[s["name"] for s in line["description"]["subjects"]] for line in lines if "description" in line]
        self.assertEqual(names[0], ["actor"])
        self.assertEqual(names[-1], ["actor", "wand"])

    def test_a_walking_actor_is_tracked_through_every_change(self):
        until(self.newest, "the first snapshot")
        until(lambda: phase(self.newest()) == TRACKING, "the actor is found in T-pose")
        until(self.walks, "the actor walks")
        session = self.feed.of("description")[-1].session_id
        fits = self.fits()

        wand = SOURCE / "config/markersets/rigid4.toml"
        self.after_change(lambda: self.ctl("subject", "add", "wand", "--marker-set", wand), "subject add")
        self.assertEqual([s.name for s in self.feed.of("description")[-1].subjects], ["actor", "wand"])
        self.added = (self.desk.folder / "mocapd.toml").read_text().split("exposure_us = 500\n")[-1]
        self.after_change(lambda: self.ctl("mask", "learn", "--images", "10", "--timeout-s", "50"), "mask learn")
        hang_up = lambda: self.daemon.send(signal.SIGHUP)
        self.write_config(threshold=70)
        self.after_change(hang_up, "SIGHUP, another threshold")
        self.write_config(threshold=70, exposure=700)
        self.after_change(hang_up, "SIGHUP, another camera")
        opened = re.findall(r"camera (\S+): streaming", self.daemon.output())
        self.assertEqual(sorted(opened), ["cam1", "cam2", "cam2", "cam3", "cam4"])

        self.assertEqual({d.session_id for d in self.feed.of("description")}, {session})
        # The body is the one that was fitted; the refiner may have fitted it anew, but nothing else may change it.
        self.assertEqual(self.bodies(), 1 + self.fits())
        self.assertGreaterEqual(self.fits(), fits)
        self.assert_described_first()
        self.daemon.send(signal.SIGTERM)
        self.assertEqual(self.daemon.wait(LONG_S), 0)
        self.assert_one_whole_recording()


if __name__ == "__main__":
    unittest.main()
