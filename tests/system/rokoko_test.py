"""mocap-rokoko, tested with a strict reader that was written from Rokoko's description of JSON v3, and with Debian's LZ4."""

import json
import math
import socket
import struct
import threading
import time
import unittest

try:
    import lz4.frame
except ImportError:
    raise SystemExit(77)

from fake_feed import SEARCHING, STANDING, TRACKING, FakeFeed
from harness import SOURCE, Desk, free_port, synthetic_volume

LONG_S = 120  # a limit that a loaded machine meets

SIDES = ("Shoulder", "UpperArm", "LowerArm", "Hand", "UpLeg", "Leg", "Foot", "Toe", "ToeEnd")
BODY = {"hip", "spine", "chest", "neck", "head", *(side + part for side in ("left", "right") for part in SIDES)}


def single(value):
    """The nearest number in single precision."""
    return struct.unpack("f", struct.pack("f", value))[0]


def read_pose(said):
    """Position and rotation x y z w of a bone or prop, in Unity's axes."""
    place, turn = said["position"], said["rotation"]
    assert set(place) == {"x", "y", "z"} and set(turn) == {"x", "y", "z", "w"}, said
    values = [*place.values(), turn["x"], turn["y"], turn["z"], turn["w"]]
    assert all(isinstance(value, (int, float)) and math.isfinite(value) for value in values), said
    assert abs(sum(value * value for value in values[3:]) - 1) < 1e-3, said
    return values


class Scene:
    """One packet. Refuses what a plug-in might misread."""

    def __init__(self, packet):
        if packet[:4] == b"\x04\x22\x4d\x18":
            packet = lz4.frame.decompress(packet)
        said = json.loads(packet.decode("utf-8"))
        assert said["version"] == 3 and said["fps"] > 0, said
        scene = said["scene"]
        self.time_s = scene["timestamp"]
        self.actors = {actor["name"]: self.read_actor(actor) for actor in scene["actors"]}
        self.props = {prop["name"]: self.read_prop(prop) for prop in scene["props"]}

    def read_actor(self, actor):
        meta, size = actor["meta"], actor["dimensions"]
        assert set(meta) == {"hasGloves", "hasLeftGlove", "hasRightGlove", "hasBody", "hasFace"}
        assert all(isinstance(value, bool) for value in meta.values())
        assert meta["hasBody"] and not meta["hasFace"]
        assert size["totalHeight"] >= size["hipHeight"] >= 0
        assert len(actor["color"]) == 3 and all(0 <= value <= 255 for value in actor["color"])
        assert BODY <= set(actor["body"]), BODY - set(actor["body"])
        return {name: read_pose(bone) for name, bone in actor["body"].items()}

    def read_prop(self, prop):
        assert prop["type"] in (0, 1, 2) and len(prop["color"]) == 3
        return read_pose(prop)


class Rokoko(unittest.TestCase):
    def setUp(self):
        self.desk = Desk()
        self.addCleanup(self.desk.close)
        self.receiver = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.addCleanup(self.receiver.close)
        self.receiver.bind(("127.0.0.1", 0))
        self.receiver.settimeout(LONG_S)

    def send(self, endpoint, *more):
        return self.desk.start("mocap-rokoko", endpoint, "--port", self.receiver.getsockname()[1], *more)

    def wait_for(self, holds):
        """The first scene for which `holds` is true."""
        limit = time.monotonic() + LONG_S
        while time.monotonic() < limit:
            scene = Scene(self.receiver.recv(65536))
            if holds(scene):
                return scene
        raise AssertionError("no such scene")

    def feed(self, **options):
        feed = FakeFeed(**options)
        self.addCleanup(feed.close)
        return feed

    def test_sends_people_and_props_plain_and_compressed(self):
        feed = self.feed(bones=["Hips", "Body"], poses=[STANDING, STANDING])
        for more in ((), ("--lz4",)):
            program = self.send(feed.endpoint, *more)

            scene = self.wait_for(lambda scene: scene.actors)

            self.assertEqual(set(scene.actors), {"actor"})
            self.assertEqual(set(scene.props), {"actor1"})
            self.assertEqual(scene.actors["actor"]["hip"][:3], [0, 1, 0])
            program.end()

    def test_sends_to_several_receivers_which_mocapctl_lists(self):
        other = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.addCleanup(other.close)
        other.bind(("127.0.0.1", 0))
        other.settimeout(LONG_S)
        folder = self.desk.folder / "status"
        folder.mkdir()
        to = [f"127.0.0.1:{other.getsockname()[1]}", "127.0.0.1"]
        self.desk.start("mocap-rokoko", "--status-file", folder / "rokoko.json", "--port", self.receiver.getsockname()[1],
                        "--to", to[0], "--to", to[1], self.feed().endpoint)

        self.wait_for(lambda scene: scene.actors)
        limit = time.monotonic() + LONG_S
        while not Scene(other.recv(65536)).actors and time.monotonic() < limit:
            pass

        listed = ""
        while "2 receivers" not in listed and time.monotonic() < limit:
            listed = self.desk.run("mocapctl", "bridge", "list", "--folder", folder).stdout
        self.assertRegex(listed, r"mocap-rokoko: 2 receivers, \d+ packets sent, 0 dropped")
        self.assertIn(to[0], listed)
        self.assertIn(f"127.0.0.1:{self.receiver.getsockname()[1]}", listed)

    def test_refuses_what_is_no_receiver(self):
        program = self.send("tcp://127.0.0.1:1", "--to", "127.0.0.1:nine")

        self.assertEqual(program.wait(LONG_S), 64)
        self.assertIn("--to 127.0.0.1:nine: expected HOST, HOST:PORT or [IPV6]:PORT", program.output())

    def test_sends_the_axis_vectors(self):
        for path in sorted((SOURCE / "proto/axes").glob("*.json")):
            case = json.loads(path.read_text())
            with self.subTest(case["name"]):
                feed = self.feed(poses=[case["mocap"]], bones=["Body"])
                program = self.send(feed.endpoint)

                found = self.wait_for(lambda scene: scene.props and next(iter(scene.props.values()))[:3] == case["unity"]["position"])

                for value, wanted in zip(found.props["actor"][3:], case["unity"]["rotation_xyzw"], strict=True):
                    self.assertAlmostEqual(value, wanted, delta=1e-6)
                program.end()
                feed.close()

    def test_people_vanish_when_they_are_lost_or_the_daemon_is_gone_and_return(self):
        feed = self.feed()
        self.send(feed.endpoint)
        self.wait_for(lambda scene: scene.actors)
        feed.phase = SEARCHING
        self.wait_for(lambda scene: not scene.actors)
        feed.phase = TRACKING
        self.wait_for(lambda scene: scene.actors)

        feed.close()
        self.wait_for(lambda scene: not scene.actors)

        self.feed(port=feed.port, session="another")
        self.wait_for(lambda scene: scene.actors)

    def test_poses_of_the_daemon_are_those_of_its_feed(self):
        self.desk.start("mocapd", "--config", self.desk.write("my.toml", synthetic_volume(self.desk.endpoint)))
        self.send(self.desk.endpoint, "--lz4", "--rate", 1000)
        self.wait_for(lambda scene: scene.actors)
        watched, scenes = [], {}
        watching = threading.Thread(target=lambda: watched.append(self.desk.run("mocap-watch", self.desk.endpoint, "--json", "--seconds", 4)))
        watching.start()
        while watching.is_alive():
            scene = Scene(self.receiver.recv(65536))
            scenes[round(scene.time_s * 1e6)] = scene

        compared = 0
        for line in watched[0].stdout.splitlines():
            said = json.loads(line)
            bones = said.get("subjects", [{}])[0].get("bones")
            scene = scenes.get(round(int(said["instants"]["exposedAtNs"]) / 1000))
            if not bones or scene is None or not scene.actors:
                continue
            compared += 1
            x, y, z = bones["worldPositionsM"][:3]  # forward, left, up; Unity: right, up, forward
            qx, qy, qz, qw = bones["worldRotationsXyzw"][:4]
            found = scene.actors["actor"]["hip"]
            sign = 1 if found[6] * qw >= 0 else -1
            for value, wanted in zip(found, [-y, z, x, sign * qy, -sign * qz, -sign * qx, sign * qw], strict=True):
                self.assertAlmostEqual(value, single(wanted), delta=1e-6)
        self.assertGreater(compared, 10)


if __name__ == "__main__":
    unittest.main(verbosity=2)
