"""mocap-natnet with a strict decoder, clients of all versions at once, and the real daemon."""

import json
import signal
import socket
import struct
import time
import unittest

import natnet_decoder as natnet
from fake_feed import SEARCHING, FakeFeed
from harness import SOURCE, Desk, free_port, synthetic_volume

VERSIONS = ((3, 0), (3, 1), (4, 0), (4, 1))
GROUP = "239.255.42.99"
LIMIT_S = 60


class Client:
    """A NatNet client with one socket, as in unicast."""

    def __init__(self, port):
        self.server = ("127.0.0.1", port)
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.settimeout(1)
        self.version = None
        self.described = False  # for this version
        self.info = self.models = self.newest = None
        self.frames = 0

    def send(self, packet):
        self.socket.sendto(packet, self.server)

    def hear(self, until, again=b"", limit_s=LIMIT_S):
        """Reads packets until one makes `until(number, payload)` true. Sends `again` after each second of silence."""
        limit = time.monotonic() + limit_s
        while time.monotonic() < limit:
            try:
                number, payload = natnet.message(self.socket.recv(65536))
            except (TimeoutError, ConnectionRefusedError):
                if again:
                    self.send(again)
                continue
            self.take(number, payload)
            if until(number, payload):
                return payload
        raise AssertionError(f"not within {limit_s} s; {self.frames} frames came")

    def take(self, number, payload):
        if number == natnet.SERVERINFO:
            self.info = natnet.server_info(payload)
            self.set_version(self.info["version"][:2])
        if number == natnet.MODELDEF:
            self.models = natnet.descriptions(payload, self.version)
            self.described = True
        if number == natnet.FRAME:
            if not self.described:
                raise AssertionError("a frame came before the descriptions")
            self.newest = natnet.frame(payload, self.version)
            self.frames += 1

    def set_version(self, version):
        self.version, self.described = version, False

    def connect(self, bitstream=None, packet=None):
        packet = packet or natnet.connect_packet(bitstream)
        self.send(packet)
        self.hear(lambda number, _: number == natnet.SERVERINFO, again=packet)

    def ask_models(self):
        ask = natnet.packet(natnet.REQUEST_MODELDEF)
        self.send(ask)
        self.hear(lambda number, _: number == natnet.MODELDEF, again=ask)
        return self.models

    def ask(self, text):
        """Returns the number of the answer and its payload."""
        ask = natnet.packet(natnet.REQUEST, text.encode() + b"\0")
        answers = (natnet.RESPONSE, natnet.UNRECOGNIZED)
        found = []
        self.send(ask)
        self.hear(lambda number, payload: number in answers and not found.append((number, payload)), again=ask)
        return found[0]

    def done(self, text):
        return self.ask(text) == (natnet.RESPONSE, struct.pack("<i", 0))

    def frame(self, holds=lambda frame: True):
        self.hear(lambda number, _: number == natnet.FRAME and holds(self.newest))
        return self.newest


class NatNet(unittest.TestCase):
    def setUp(self):
        self.desk = Desk()
        self.addCleanup(self.desk.close)

    def feed(self, **options):
        feed = FakeFeed(**options)
        self.addCleanup(feed.close)
        return feed

    def serve(self, endpoint, *more):
        self.port = free_port()
        self.status_file = self.desk.folder / "status.json"
        self.bridge = self.desk.start("mocap-natnet", endpoint, "--command-port", self.port, "--status-file", self.status_file, *more)

    def client(self, bitstream=None, packet=None):
        client = Client(self.port)
        self.addCleanup(client.socket.close)
        client.connect(bitstream, packet)
        return client

    def status(self, holds):
        limit = time.monotonic() + LIMIT_S
        status = None
        while time.monotonic() < limit:
            if self.status_file.exists():
                status = json.loads(self.status_file.read_text())
                if holds(status):
                    return status
            time.sleep(0.1)
        raise AssertionError(f"not within {LIMIT_S} s: {status} {self.bridge.output()}")

    def test_each_version_is_decoded_by_a_client_of_its_own(self):
        self.serve(self.feed(bones=("Hips", ("Hips", "Spine")), poses=({"position": [0, 0, 1], "rotation_xyzw": [0, 0, 0, 1]},) * 2,
                             points=((1, 2, 3),)).endpoint)
        clients = [self.client(version) for version in VERSIONS]
        for client, version in zip(clients, VERSIONS, strict=True):
            with self.subTest(version):
                self.assertEqual(client.info["version"][:2], version)
                self.assertEqual((client.info["name"], client.info["ticks"], client.info["multicast"]), ("mocapd", 10**9, 0))
                client.ask_models()
        for client, version in zip(clients, VERSIONS, strict=True):
            with self.subTest(version):
                frame = client.frame()
                self.assertEqual(list(frame["bodies"]), [1])
                self.assertEqual([bone["id"] for bone in frame["skeletons"][2]], [(2 << 16) + 1, (2 << 16) + 2])
                self.assertEqual(client.models["skeletons"][2]["bones"][1]["parent"], 1)
                self.assertEqual(list(frame["marker_sets"]), ["actor", "actor1", "all"])
                self.assertEqual(list(client.models["marker_sets"]), ["actor", "actor1", "all"])
                self.assertEqual(frame["others"], [(2, 3, 1)])
                self.assertEqual([(one["id"], one["flags"]) for one in frame["labelled"]], [((1 << 16) + 1, 10), ((2 << 16) + 1, 10), (1, 18)])
                self.assertLessEqual(frame["exposed"], frame["sent"])
                self.assertLess(abs(frame["sent"] - time.monotonic_ns()), 60e9)

    def test_sends_the_axis_vectors_in_both_axes(self):
        for path in sorted((SOURCE / "proto/axes").glob("*.json")):
            case = json.loads(path.read_text())
            with self.subTest(case["name"]):
                feed = FakeFeed(poses=[case["mocap"]], bones=("Body",))
                self.addCleanup(feed.close)
                self.serve(feed.endpoint)
                for name, axis in (("natnet_y_up", "Y-Axis"), ("natnet_z_up", "Z-Axis")):
                    client = self.client((4, 1))
                    self.assertTrue(client.done(f"SetProperty,,Up Axis,{axis}"))
                    client.ask_models()

                    body = client.frame(lambda frame: frame["bodies"])["bodies"][1]

                    expected = case[name]["position"] + case[name]["rotation_xyzw"]
                    for found, wanted in zip(body["position"] + body["rotation"], expected, strict=True):
                        self.assertAlmostEqual(found, wanted, delta=1e-5)
                self.bridge.end()

    def test_settings_belong_to_one_client(self):
        self.serve(self.feed(bones=(("Hips", "LeftUpperArm"),)).endpoint)
        plain, changed = self.client((4, 1)), self.client((3, 0))
        for text in ("SetProperty,,Labeled Markers,false", "SetProperty,Asset Markers,false", "SetProperty,,Trained Markerset Bones,false",
                     "SetProperty,,Skeleton Coordinates,Local", "SetProperty,,Bone Naming Convention,FBX"):
            self.assertTrue(changed.done(text), text)
        self.assertEqual(changed.ask("GetProperty,,Bone Naming Convention"), (natnet.RESPONSE, b"FBX\0"))
        for text in ("SetProperty,,Up Axis,X-Axis", "SetProperty,actor,Active,false", "SetProperty", "StartRecording", "TimelinePlay"):
            self.assertEqual(changed.ask(text), (natnet.RESPONSE, struct.pack("<i", 1)), text)
        self.assertEqual(changed.ask("Dance")[0], natnet.UNRECOGNIZED)
        self.assertEqual(changed.ask("FrameRate"), (natnet.RESPONSE, struct.pack("<f", 100)))
        self.assertEqual([bone["name"] for bone in changed.ask_models()["skeletons"][1]["bones"]], ["actor_Hips", "actor_LeftArm"])
        self.assertEqual([bone["name"] for bone in plain.ask_models()["skeletons"][1]["bones"]], ["actor_Hip", "actor_LUArm"])

        frame = changed.frame()
        self.assertEqual((frame["marker_sets"], frame["labelled"], list(frame["skeletons"])), ({}, [], [1]))
        self.assertTrue(plain.frame()["labelled"])

    def test_a_client_changes_its_version_and_gets_no_frame_before_the_descriptions(self):
        self.serve(self.feed().endpoint)
        client = self.client((4, 1))
        client.ask_models()
        client.frame()
        self.assertEqual(client.ask("Bitstream"), (natnet.RESPONSE, b"Bitstream,4.1\0"))
        self.assertEqual(client.ask("Bitstream,3.1"), (natnet.RESPONSE, b"Bitstream,3.1\0"))
        client.set_version((3, 1))

        client.frame()  # without a request for the descriptions: they come by themselves

        self.assertEqual(client.ask("Bitstream,4.0"), (natnet.RESPONSE, b"Bitstream,4.0\0"))
        client.set_version((4, 0))
        client.ask_models()
        client.frame()

    def test_old_and_bare_clients_get_what_they_can_read(self):
        self.serve(self.feed().endpoint)
        for packet, version in ((natnet.packet(natnet.CONNECT), (3, 1)), (natnet.packet(natnet.CONNECT, b"Ping\0", 0), (3, 1)),
                                (natnet.connect_packet(own=(4, 0)), (4, 0)), (natnet.connect_packet((2, 9)), (3, 0)),
                                (natnet.connect_packet((9, 9)), (4, 1))):
            with self.subTest(packet[:6]):
                client = self.client(packet=packet)
                self.assertEqual(client.version, version)
                client.frame()  # without a request for descriptions, and without a keep-alive
                self.assertIsNotNone(client.models)

    def test_answers_the_echo_with_its_clock(self):
        self.serve(self.feed().endpoint)
        client = self.client()
        ask = natnet.packet(natnet.ECHOREQUEST, struct.pack("<Q", 12345))
        before = time.monotonic_ns()
        client.send(ask)

        payload = client.hear(lambda number, _: number == natnet.ECHORESPONSE, again=ask)

        stamp, ticks = struct.unpack("<QQ", payload)
        self.assertEqual(stamp, 12345)
        self.assertTrue(before <= ticks <= time.monotonic_ns())

    def test_subscriptions_select_subjects(self):
        standing = {"position": [0, 0, 1], "rotation_xyzw": [0, 0, 0, 1]}
        self.serve(self.feed(bones=("Body", "Body"), poses=(standing, standing)).endpoint)
        client = self.client((4, 1))
        self.assertTrue(client.done("SubscribeToData,RigidBody,actor1"))
        client.ask_models()
        self.assertEqual(list(client.frame()["bodies"]), [2])
        self.assertTrue(client.done("SubscribeToData"))
        self.assertTrue(client.done("SubscribeByID,RigidBody,1"))
        client.frame(lambda frame: list(frame["bodies"]) == [1])

    def test_describes_anew_after_a_change(self):
        feed = self.feed()
        self.serve(feed.endpoint)
        client = self.client((4, 1))
        client.ask_models()
        client.frame(lambda frame: frame["flags"] & 2 == 0)
        feed.bones, feed.poses, feed.version = ("Hips", "Body"), feed.poses * 2, 2

        client.hear(lambda number, _: number == natnet.MODELDEF)

        self.assertEqual(list(client.models["bodies"]), [1, 2])
        self.assertEqual(client.frame()["flags"] & 2, 2)

    def test_the_loss_of_the_daemon_is_no_frozen_pose(self):
        feed = FakeFeed()
        self.serve(feed.endpoint)
        client = self.client((4, 1))
        client.ask_models()
        client.frame(lambda frame: frame["bodies"][1]["tracked"] == 1)
        feed.close()

        lost = client.frame(lambda frame: frame["bodies"][1]["tracked"] == 0)

        self.assertEqual(lost["bodies"][1]["position"], (0, 0, 0))
        self.assertEqual(lost["labelled"], [])
        self.feed(port=feed.port, session="second")
        client.frame(lambda frame: frame["bodies"][1]["tracked"] == 1)
        self.assertEqual(self.status(lambda status: status["losses"] == 1)["dropped"], 0)

    def test_a_subject_that_is_not_tracked_has_the_flag_off(self):
        self.serve(self.feed(phase=SEARCHING).endpoint)
        client = self.client()
        client.ask_models()
        self.assertEqual(client.frame()["bodies"][1]["tracked"], 0)

    def test_forgets_clients_that_are_gone(self):
        feed = self.feed()
        for end, options in (("says so", ()), ("closes", ()), ("is silent", ("--forget-after", 3))):
            with self.subTest(end):
                self.serve(feed.endpoint, *options)
                client = self.client()
                client.ask_models()
                client.frame()
                if end == "says so":
                    client.send(natnet.packet(natnet.DISCONNECT))
                if end == "closes":
                    client.socket.close()
                self.status(lambda status: status["receivers"] == [] and status["requests"] > 0)
                self.bridge.end()
                self.status_file.unlink()

    def test_a_client_outlives_a_restart_of_the_bridge_by_its_keep_alives(self):
        feed = self.feed()
        self.serve(feed.endpoint)
        client = self.client((4, 1))
        client.ask_models()
        client.frame()
        self.bridge.send(signal.SIGTERM)
        self.assertEqual(self.bridge.wait(LIMIT_S), 0)
        self.bridge = self.desk.start("mocap-natnet", feed.endpoint, "--command-port", self.port)

        client.hear(lambda number, _: number == natnet.SERVERINFO, again=natnet.packet(natnet.KEEPALIVE))

        self.assertEqual(client.version, (3, 1))
        client.frame()

    def test_multicast_reaches_several_receivers(self):
        data_port = free_port()
        self.serve(self.feed().endpoint, "--multicast", GROUP, "--data-port", data_port, "--bitstream", "4.0", "--up", "z")
        client = self.client((4, 1))
        self.assertEqual((client.version, client.info["multicast"], client.info["port"]), ((4, 0), 1, data_port))
        self.assertEqual(client.info["group"], (239, 255, 42, 99))
        self.assertEqual(client.ask("SetProperty,,Up Axis,Y-Axis"), (natnet.RESPONSE, struct.pack("<i", 1)))
        client.ask_models()
        for _ in range(2):
            receiver = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
            self.addCleanup(receiver.close)
            receiver.settimeout(LIMIT_S)
            receiver.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            receiver.bind(("", data_port))
            receiver.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, socket.inet_aton(GROUP) + socket.inet_aton("127.0.0.1"))
            number, payload = natnet.message(receiver.recv(65536))
            self.assertEqual(number, natnet.FRAME)
            self.assertEqual(natnet.frame(payload, (4, 0))["bodies"][1]["position"], (0, 0, 1))
        self.assertEqual(client.frames, 0)

    def test_a_flood_of_nonsense_disturbs_nobody(self):
        self.serve(self.feed().endpoint)
        client = self.client((4, 1))
        client.ask_models()
        hostile = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.addCleanup(hostile.close)
        for size in (0, 1, 3, 4, 5, 300, 60000):
            for first in range(110):
                hostile.sendto(bytes((first,)) * size, ("127.0.0.1", self.port))
        client.frames = 0
        client.frame(lambda frame: client.frames > 20)
        self.assertIsNone(self.bridge.process.poll(), self.bridge.output())

    def test_warns_if_other_machines_can_reach_it(self):
        self.serve(self.feed().endpoint, "--listen", "0.0.0.0")
        self.client().ask_models()
        self.assertIn("neither encryption nor passwords", self.bridge.output())

    def test_refuses_a_receiver_that_the_loopback_address_does_not_reach(self):
        ended = self.desk.run("mocap-natnet", "--to", "127.0.0.1:1511", "--to", "10.0.0.5:1511")

        self.assertEqual(ended.returncode, 64, ended.stderr)
        self.assertIn("--to: 10.0.0.5:1511: is on another machine: give --listen an address of this machine", ended.stderr)

    def test_a_client_records_a_take_through_the_control_endpoint(self):
        self.desk.start("mocapd", "--config", self.desk.write("my.toml", synthetic_volume(self.desk.endpoint)))
        host, port = self.desk.endpoint.rsplit(":", 1)
        self.serve(self.desk.endpoint, "--control", f"{host}:{int(port) + 1}")
        client = self.client((4, 1))
        take = self.desk.folder / "takes/night walk.mcap"
        self.assertTrue(client.done("SetRecordTakeName,night walk"))

        self.assertTrue(client.done("StartRecording"))
        self.wait(take.exists)
        self.assertTrue(client.done("StopRecording"))
        self.wait(lambda: "take" in self.bridge.output() and self.shown(take)["state"] == "complete")

        self.assertTrue(client.done("StopRecording"))  # accepted by the bridge, refused by the daemon
        self.wait(lambda: "a client's order was refused" in self.bridge.output())
        self.bridge.send(signal.SIGTERM)
        self.assertEqual(self.bridge.wait(LIMIT_S), 0)  # the thread of the orders does not get the signal

    def shown(self, take):
        return json.loads(self.desk.run("mocapctl", "take", "show", take, "--json").stdout)

    def wait(self, holds):
        limit = time.monotonic() + LIMIT_S
        while not holds():
            self.assertLess(time.monotonic(), limit, self.bridge.output())
            time.sleep(0.05)

    def test_mocapctl_lists_the_bridge_and_its_clients(self):
        self.serve(self.feed().endpoint)
        self.client((4, 1)).ask_models()
        self.status(lambda status: len(status["receivers"]) == 1)

        listed = self.desk.run("mocapctl", "bridge", "list", "--folder", self.status_file.parent).stdout

        self.assertRegex(listed, r"mocap-natnet: 1 receiver, \d+ packets sent, 0 dropped")
        self.assertRegex(listed, r"127\.0\.0\.1:\d+ +4\.1")

    def test_poses_of_the_daemon_equal_those_of_another_client(self):
        config = self.desk.write("my.toml", synthetic_volume(self.desk.endpoint))
        self.desk.start("mocapd", "--config", config)
        self.serve(self.desk.endpoint)
        watched = {}
        watch = self.desk.watch()
        client = self.client((4, 1))
        client.ask_models()
        client.frame(lambda frame: frame["skeletons"] and all(bone["tracked"] for bone in frame["skeletons"][1]))
        frames = {}
        limit = time.monotonic() + 120
        while len(frames.keys() & watched.keys()) < 5 and time.monotonic() < limit:
            frame = client.frame()
            if frame["skeletons"][1][0]["tracked"]:
                frames[frame["number"]] = frame
            snapshot = watch.newest
            if snapshot is not None and snapshot.get("subjects", [{}])[0].get("bones"):
                watched[int(snapshot["number"])] = snapshot
        both = frames.keys() & watched.keys()
        self.assertGreaterEqual(len(both), 5)
        for number in both:
            bones = watched[number]["subjects"][0]["bones"]
            places, turns = bones["worldPositionsM"], bones["worldRotationsXyzw"]
            for i, bone in enumerate(frames[number]["skeletons"][1]):
                forward, left, up = places[3 * i:3 * i + 3]
                x, y, z, w = turns[4 * i:4 * i + 4]
                for found, wanted in zip(bone["position"] + bone["rotation"], (left, up, forward, y, z, x, w), strict=True):
                    self.assertAlmostEqual(found, wanted, delta=1e-5)


if __name__ == "__main__":
    unittest.main(verbosity=2)
