"""The state of the Python client, and the kinds of events in the clients in Python, C and C#."""

import os
import pathlib
import re
import sys
import time
import unittest

import zmq

BUILD = pathlib.Path(os.environ.get("MOCAP_BUILD_DIR", "build/release")).resolve()
ROOT = pathlib.Path(__file__).resolve().parents[2]
CLIENTS = ROOT / "tools/clients"
sys.path[:0] = [str(CLIENTS / "python"), str(BUILD / "python")]

import mocap.v1.description_pb2 as description_pb2  # noqa: E402
import mocap.v1.event_pb2 as event_pb2  # noqa: E402
import mocap.v1.snapshot_pb2 as snapshot_pb2  # noqa: E402
from mocap_client import Client, Diagnosis, EventKind  # noqa: E402
from mocap_client.event import event_of  # noqa: E402

LIMIT_S = 60  # of a failing test
SECOND_NS = 1_000_000_000
KINDS = {name.removeprefix("EVENT_KIND_"): number for name, number in event_pb2.EventKind.items() if number > 0}


class Feed:
    """Publishes a description without subjects, and snapshots whose age the test chooses."""

    def __init__(self):
        self._context = zmq.Context()
        self._socket = self._context.socket(zmq.XPUB)
        self._socket.setsockopt(zmq.XPUB_WELCOME_MSG, b"description\0" + description_pb2.Description(
            protocol="mocap.v1", version=1, session_id="session").SerializeToString())
        self.endpoint = f"tcp://127.0.0.1:{self._socket.bind_to_random_port('tcp://127.0.0.1')}"
        self._sequence = 0

    def close(self):
        self._context.destroy(linger=0)

    def welcome(self):
        """A new subscriber gets the description."""
        while self._socket.poll(0):
            self._socket.recv()

    def send(self, age_ns):
        """The snapshot has waited this long for the reader."""
        said = snapshot_pb2.Snapshot(number=self._sequence, sequence=self._sequence, description_version=1,
                                     utc_minus_host_ns=time.time_ns() - time.monotonic_ns())
        said.instants.exposed_at_ns = said.instants.sent_at_ns = time.monotonic_ns() - age_ns
        self._socket.send(b"snapshot\0" + said.SerializeToString())
        self._sequence += 1


class Diagnoses(unittest.TestCase):
    def setUp(self):
        self.feed = Feed()
        self.addCleanup(self.feed.close)
        self.client = Client(self.feed.endpoint, keep="all")
        self.addCleanup(self.client.close)

    def wait(self, holds):
        limit = time.monotonic() + LIMIT_S
        while not holds():
            self.assertLess(time.monotonic(), limit)
            self.feed.welcome()
            time.sleep(0.002)

    def receive(self, ages_ns):
        """The client receives snapshots of these ages, and its reader has read the first."""
        self.wait(lambda: self.client.diagnose() and self.client.description is not None)
        before = self.client.statistics().received
        for age_ns in ages_ns:
            self.feed.send(age_ns)
        self.wait(lambda: self.client.diagnose() and self.client.statistics().received >= before + len(ages_ns))
        self.assertIsNotNone(self.client.poll())

    def test_old_frames_of_a_slow_reader_are_no_fault_of_the_clocks(self):
        self.receive([10 * SECOND_NS, 5 * SECOND_NS, 0])
        self.assertEqual(self.client.diagnose()[0], Diagnosis.WELL)

    def test_a_clock_that_is_behind_is_a_fault(self):
        self.receive([10 * SECOND_NS, 10 * SECOND_NS, 10 * SECOND_NS])
        self.assertEqual(self.client.diagnose()[0], Diagnosis.CLOCK_SKEW)


class EventKinds(unittest.TestCase):
    def test_every_client_has_every_kind(self):
        header = (CLIENTS / "c/mocap_client.h").read_text()
        enumeration = re.search(r"enum mocap_event_kind \{(.*?)\};", header, re.DOTALL)[1]
        self.assertEqual({name: int(number) for name, number in re.findall(r"MOCAP_EVENT_(\w+) = (\d+)", enumeration)}, KINDS)
        source = (CLIENTS / "csharp/MocapControl.cs").read_text()
        enumeration = re.search(r"enum EventKind \{(.*?)\}", source, re.DOTALL)[1]
        named = {name: int(number) for name, number in re.findall(r"(\w+) = (\d+)", enumeration)}
        self.assertEqual(named, {"Unknown": 0, **{name.title().replace("_", ""): number for name, number in KINDS.items()}})
        self.assertEqual({kind.name: kind.value for kind in EventKind}, {"UNKNOWN": 0, **KINDS})

    def test_an_unknown_kind_keeps_its_number(self):
        event = event_of(event_pb2.Event.FromString(event_pb2.Event(kind=99, sequence=3).SerializeToString()), None)
        self.assertEqual((event.kind, event.kind_number), (EventKind.UNKNOWN, 99))
        event = event_of(event_pb2.Event(kind=6, message="walk_1"), None)
        self.assertEqual((event.kind, event.kind_number, event.message), (EventKind.TAKE_STARTED, 6, "walk_1"))


if __name__ == "__main__":
    unittest.main(verbosity=2)
