"""mocap-vrpn, tested with a strict client that was written from the description of the protocol."""

import json
import math
import random
import socket
import threading
import time
import unittest

from fake_feed import SEARCHING, STANDING, TRACKING, FakeFeed
from harness import SOURCE, Desk, free_port, synthetic_volume
from vrpn_client import HEADER, VrpnClient, message

LONG_S = 120  # a limit that a loaded machine meets


class Vrpn(unittest.TestCase):
    def setUp(self):
        self.desk = Desk()
        self.addCleanup(self.desk.close)
        self.port = free_port()

    def serve(self, endpoint, *more):
        program = self.desk.start("mocap-vrpn", endpoint, "--port", self.port, *more)
        self.wait_for(program, "serves TCP and UDP")
        return program

    def wait_for(self, program, text):
        limit = time.monotonic() + LONG_S
        while text not in program.output():
            self.assertLess(time.monotonic(), limit, program.output())
            time.sleep(0.02)

    def feed(self, **options):
        feed = FakeFeed(**options)
        self.addCleanup(feed.close)
        return feed

    def client(self, **options):
        client = VrpnClient(self.port, **options)
        self.addCleanup(client.close)
        return client

    def test_sends_the_axis_vectors_with_z_up_and_with_y_up(self):
        cases = [json.loads(path.read_text()) for path in sorted((SOURCE / "proto/axes").glob("*.json"))]
        feed = self.feed(poses=[case["mocap"] for case in cases], bones=["Body"] * len(cases))
        for axes, options in (("mocap", ()), ("gltf", ("--y-up",))):
            program = self.serve(feed.endpoint, *options)
            client = self.client()

            self.assertTrue(client.receive(LONG_S, lambda: len(client.poses) >= 2 * len(cases)), program.output())

            found = {report.name: report.values for report in client.poses}
            for i, case in enumerate(cases):
                expected = case[axes]["position"] + case[axes]["rotation_xyzw"]
                for value, wanted in zip(found[f"actor{i}" if i else "actor"], expected, strict=True):
                    self.assertAlmostEqual(value, wanted, delta=1.2e-7, msg=case["name"])  # single precision
            program.end()

    def test_serves_clients_by_tcp_and_udp_also_if_they_are_called_back(self):
        feed = self.feed(bones=[("Hips", "Spine"), "Body"], poses=[STANDING, STANDING])
        program = self.serve(feed.endpoint)
        for called_back in (False, True):
            for udp in (False, True):
                with self.subTest(called_back=called_back, udp=udp):
                    client = self.client(called_back=called_back, udp=udp)

                    self.assertTrue(client.receive(LONG_S, lambda: len(client.poses) >= 9), program.output())

                    self.assertEqual({report.name for report in client.poses}, {"actor/Hips", "actor/Spine", "actor1"})
                    self.assertEqual(client.by_udp > 0, udp)

    def test_closes_a_client_whose_udp_port_is_closed_and_serves_the_others(self):
        program = self.serve(self.feed().endpoint)
        client = self.client(udp=True)
        self.assertTrue(client.receive(LONG_S, lambda: client.by_udp > 0), program.output())

        client.close_datagrams()

        self.assertTrue(client.wait_for_end(LONG_S), program.output())
        self.assertIn("nobody listens at its UDP port", program.output())
        another = self.client(called_back=True, udp=True)
        self.assertTrue(another.receive(LONG_S, lambda: another.by_udp > 0), program.output())

    def test_sends_what_a_client_describes_and_answers_its_pings(self):
        feed = self.feed(bones=[("Hips", "Spine"), "Body"], poses=[STANDING, STANDING])
        self.serve(feed.endpoint, "--senders", "both")
        client = self.client()
        client.want(0, "VRPN Control")
        client.want(1, "actor")
        self.assertTrue(client.receive(LONG_S, lambda: client.poses))  # only a sender that the feed has answers
        client.ping(1)
        self.assertTrue(client.receive(LONG_S, lambda: client.pongs))
        client.poses.clear()

        self.assertTrue(client.receive(LONG_S, lambda: len(client.poses) >= 10))

        self.assertEqual({(report.name, report.sensor) for report in client.poses}, {("actor", 0), ("actor", 1)})
        self.assertEqual(client.pongs, ["actor"])

    def test_sends_velocities(self):
        moving = dict(STANDING, velocity=[1.0, 2.0, 3.0], spin=[0.0, 0.0, 4.0])
        feed = self.feed(poses=[moving], bones=["Body"])
        self.serve(feed.endpoint)
        client = self.client()

        self.assertTrue(client.receive(LONG_S, lambda: client.velocities))

        values = client.velocities[0].values
        self.assertEqual(values[:3], [1.0, 2.0, 3.0])
        for found, wanted in zip(values[3:], [0, 0, math.sin(0.02), math.cos(0.02), 0.01], strict=True):
            self.assertAlmostEqual(found, wanted, delta=1e-9)

    def test_reports_stop_with_a_warning_when_the_daemon_is_gone_and_return(self):
        feed = FakeFeed()
        self.serve(feed.endpoint)
        client = self.client()
        self.assertTrue(client.receive(LONG_S, lambda: client.poses))

        feed.close()
        self.assertTrue(client.receive(LONG_S, lambda: client.texts))
        self.assertEqual(client.texts[0][0], 1)  # a warning
        client.poses.clear()
        self.assertFalse(client.receive(1, lambda: client.poses))
        client.want(1, "actor")
        client.ping(1)
        self.assertTrue(client.receive(LONG_S, lambda: client.pongs))  # the server itself is there

        self.feed(port=feed.port, session="another")
        self.assertTrue(client.receive(LONG_S, lambda: client.poses))
        self.assertEqual(client.texts[-1], (0, "mocapd sends again"))

    def test_a_subject_that_is_lost_has_no_reports(self):
        feed = self.feed()
        self.serve(feed.endpoint)
        client = self.client()
        self.assertTrue(client.receive(LONG_S, lambda: client.poses))

        feed.phase = SEARCHING
        self.assertTrue(self.falls_silent(client))
        feed.phase = TRACKING
        self.assertTrue(client.receive(LONG_S, lambda: client.poses))

    def falls_silent(self, client):
        limit = time.monotonic() + LONG_S
        while time.monotonic() < limit:
            client.poses.clear()
            if not client.receive(0.5, lambda: client.poses):
                return True
        return False

    def test_mocapctl_lists_the_bridge_and_its_clients(self):
        folder = self.desk.folder / "status"
        folder.mkdir()
        self.serve(self.feed().endpoint, "--status-file", folder / "vrpn.json")
        client = self.client()
        self.assertTrue(client.receive(LONG_S, lambda: client.poses))

        listed = ""
        limit = time.monotonic() + LONG_S
        while "1 receiver," not in listed and time.monotonic() < limit:
            client.receive(0.5)
            listed = self.desk.run("mocapctl", "bridge", "list", "--folder", folder).stdout

        self.assertRegex(listed, r"mocap-vrpn: 1 receiver, \d+ packets sent, 0 dropped")
        self.assertRegex(listed, r"127\.0\.0\.1:\d+ +tcp")

    def test_hostile_clients_disturb_nobody(self):
        feed = self.feed()
        program = self.serve(feed.endpoint)
        client = self.client()
        rng = random.Random(1)
        hostile = [b"GET / HTTP/1.1\r\n\r\n" * 10, b"vrpn: ver. 07.35  0\0\0\0\0\0" + b"\xff" * 200,
                   b"vrpn: ver. 07.35  0\0\0\0\0\0" + HEADER.pack(2**31 - 1, 0, 0, 0, 0, 0) + b"a" * 5000,
                   b"vrpn: ver. 07.35  0\0\0\0\0\0" + message(-1, -3, b"")]
        hostile += [b"vrpn: ver. 07.35  0\0\0\0\0\0" + rng.randbytes(rng.randrange(2000)) for _ in range(40)]
        for data in hostile:
            with socket.create_connection(("127.0.0.1", self.port), LONG_S) as one:
                one.sendall(data)
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as one:
            for _ in range(500):
                one.sendto(rng.randbytes(rng.randrange(1400)), ("127.0.0.1", self.port))
        unread = socket.create_connection(("127.0.0.1", self.port), LONG_S)  # never reads and never says anything
        self.addCleanup(unread.close)
        client.poses.clear()

        self.assertTrue(client.receive(LONG_S, lambda: len(client.poses) >= 200), program.output())
        self.assertIsNone(program.process.poll(), program.output())

    def test_poses_of_the_daemon_are_those_of_its_feed(self):
        self.desk.start("mocapd", "--config", self.desk.write("my.toml", synthetic_volume(self.desk.endpoint)))
        program = self.serve(self.desk.endpoint)
        client = self.client()
        self.assertTrue(client.receive(LONG_S, lambda: client.poses), program.output())
        watched = []
        watching = threading.Thread(target=lambda: watched.append(self.desk.run("mocap-watch", self.desk.endpoint, "--json", "--seconds", 4)))
        watching.start()
        self.assertTrue(client.receive(LONG_S, lambda: not watching.is_alive()))

        reports = {(report.name, report.stamp_us): report.values for report in client.poses}
        compared = 0
        for line in watched[0].stdout.splitlines():
            said = json.loads(line)
            bones = said.get("subjects", [{}])[0].get("bones")
            if not bones:
                continue
            stamp_us = (int(said["instants"]["exposedAtNs"]) + int(said["utcMinusHostNs"])) // 1000
            hips = reports.get(("actor/Hips", stamp_us))
            if hips is None:
                continue
            compared += 1
            expected = bones["worldPositionsM"][:3] + bones["worldRotationsXyzw"][:4]
            for found, wanted in zip(hips, expected, strict=True):
                self.assertAlmostEqual(found, wanted, delta=1e-6)
        self.assertGreater(compared, 10, program.output())
        self.assertEqual(len({report.name for report in client.poses}), 18)


if __name__ == "__main__":
    unittest.main(verbosity=2)
