"""mocap-vmc with both of its protocols, tested with an independent OSC implementation (liblo)."""

import json
import struct
import socket
import time
import unittest

try:
    import liblo
except ImportError:
    raise SystemExit(77)

from fake_feed import SEARCHING, TRACKING, FakeFeed
from harness import SOURCE, Desk, free_port, synthetic_volume


class Receiver:
    """A VMC receiver ("marionette" in the protocol)."""

    def __init__(self):
        self.port = free_port()
        self.server = liblo.Server(self.port, liblo.UDP)
        self.server.add_method(None, None, self._take)
        self.said = {}
        self.bones = {}

    def _take(self, path, values, types, _source):
        self.said[path] = (types, values)
        if path == "/VMC/Ext/Bone/Pos":
            self.bones[values[0]] = values[1:]

    def hear(self, seconds, until=lambda: False):
        limit = time.monotonic() + seconds
        while time.monotonic() < limit and not until():
            self.server.recv(50)


class Vmc(unittest.TestCase):
    def start(self, *more, **options):
        feed = FakeFeed(**options)
        self.addCleanup(feed.close)
        desk = Desk()
        self.addCleanup(desk.close)
        receiver = Receiver()
        program = desk.start("mocap-vmc", feed.endpoint, "--port", receiver.port, *more)
        return feed, receiver, program

    def test_sends_the_axis_vectors_in_unitys_axes(self):
        for path in sorted((SOURCE / "proto/axes").glob("*.json")):
            case = json.loads(path.read_text())
            with self.subTest(case["name"]):
                feed = FakeFeed(poses=[case["mocap"]])
                self.addCleanup(feed.close)
                desk = Desk()
                self.addCleanup(desk.close)
                receiver = Receiver()
                desk.start("mocap-vmc", feed.endpoint, "--port", receiver.port, "--seconds", 10)

                receiver.hear(8, until=lambda: "Hips" in receiver.bones)

                expected = case["unity"]["position"] + case["unity"]["rotation_xyzw"]
                for found, wanted in zip(receiver.bones["Hips"], expected, strict=True):
                    self.assertAlmostEqual(found, wanted, delta=1e-5)

    def test_sends_all_messages_that_a_receiver_needs(self):
        _, receiver, program = self.start()

        receiver.hear(8, until=lambda: "/VMC/Ext/Bone/Pos" in receiver.said)

        self.assertEqual(receiver.said.get("/VMC/Ext/OK"), ("iiii", [1, 3, 0, 1]), program.output())
        self.assertEqual(receiver.said["/VMC/Ext/T"][0], "f")
        self.assertEqual(receiver.said["/VMC/Ext/Root/Pos"], ("sfffffff", ["root", 0, 0, 0, 0, 0, 0, 1]))
        self.assertEqual(receiver.said["/VMC/Ext/Bone/Pos"][0], "sfffffff")

    def test_reports_that_nobody_is_tracked(self):
        _, receiver, _ = self.start(phase=SEARCHING)

        receiver.hear(8, until=lambda: "/VMC/Ext/OK" in receiver.said)

        self.assertEqual(receiver.said["/VMC/Ext/OK"][1], [1, 3, 0, 0])
        self.assertEqual(receiver.bones, {})

    def test_the_loss_of_the_daemon_is_no_frozen_pose(self):
        feed, receiver, program = self.start()
        tracked = lambda: receiver.said.get("/VMC/Ext/OK", (None, [None] * 4))[1][3]  # noqa: E731
        receiver.hear(60, until=lambda: tracked() == 1)
        self.assertEqual(tracked(), 1, program.output())

        feed.close()
        receiver.hear(60, until=lambda: tracked() == 0)
        self.assertEqual(tracked(), 0, program.output())

        again = FakeFeed(port=feed.port, session="another")
        self.addCleanup(again.close)
        receiver.hear(60, until=lambda: tracked() == 1)
        self.assertEqual(tracked(), 1, program.output())

    def test_sends_the_axis_vectors_as_trackers_of_vrchat(self):
        for path in sorted((SOURCE / "proto/axes").glob("*.json")):
            case = json.loads(path.read_text())
            with self.subTest(case["name"]):
                _, receiver, program = self.start("--protocol", "vrchat", poses=[case["mocap"]])

                receiver.hear(60, until=lambda: "/tracking/trackers/1/rotation" in receiver.said)

                types, values = receiver.said["/tracking/trackers/1/position"]
                self.assertEqual((types, values), ("fff", case["vrchat"]["position"]), program.output())
                for found, wanted in zip(receiver.said["/tracking/trackers/1/rotation"][1], case["vrchat"]["euler_deg"], strict=True):
                    self.assertAlmostEqual(found, wanted, delta=0.03)  # single precision near the pole

    def test_trackers_stop_when_nobody_is_tracked_and_return(self):
        feed, receiver, program = self.start("--protocol", "vrchat")
        receiver.hear(60, until=lambda: receiver.said)
        self.assertTrue(receiver.said, program.output())

        feed.phase = SEARCHING
        limit = time.monotonic() + 60
        while receiver.said and time.monotonic() < limit:
            receiver.said.clear()
            receiver.hear(0.5, until=lambda: receiver.said)
        self.assertEqual(receiver.said, {})
        feed.phase = TRACKING
        receiver.hear(60, until=lambda: receiver.said)

        self.assertIn("/tracking/trackers/1/position", receiver.said)

    def test_a_whole_body_fits_into_unsplit_packets_with_bones_relative_to_parents(self):
        desk = Desk()
        self.addCleanup(desk.close)
        port = free_port()
        listener = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.addCleanup(listener.close)
        listener.bind(("127.0.0.1", port))
        listener.settimeout(120)
        config = desk.write("my.toml", synthetic_volume(desk.endpoint))
        desk.start("mocapd", "--config", config)
        desk.start("mocap-vmc", desk.endpoint, "--port", port)
        bones, largest = {}, 0
        limit = time.monotonic() + 120
        while len(bones) < 18 and time.monotonic() < limit:
            packet = listener.recv(65536)
            largest = max(largest, len(packet))
            self.assertEqual(packet[:8], b"#bundle\0")
            at = 16
            while at < len(packet):  # parsed by hand, independently of liblo
                (size,) = struct.unpack(">i", packet[at:at + 4])
                message = packet[at + 4:at + 4 + size]
                if message.startswith(b"/VMC/Ext/Bone/Pos\0"):
                    name = message[32:].split(b"\0")[0].decode()
                    bones[name] = struct.unpack(">7f", message[-28:])
                at += 4 + size

        self.assertLessEqual(largest, 1400)
        self.assertEqual(len(bones), 18)
        # Hips are relative to the world; a foot is relative to its lower leg, 0.41 m below it in any pose.
        self.assertGreater(bones["Hips"][1], 0.5)
        self.assertAlmostEqual(sum(v * v for v in bones["LeftFoot"][:3]) ** 0.5, (0.045**2 + 0.41**2) ** 0.5, delta=0.05)
        for name, values in bones.items():
            self.assertAlmostEqual(sum(v * v for v in values[3:]), 1.0, delta=1e-3, msg=name)


if __name__ == "__main__":
    unittest.main(verbosity=2)
