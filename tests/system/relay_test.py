"""mocap-relay with Debian's nats-server over TLS: daemon -> relay -> server -> the two receivers."""

import json
import math
import os
import pathlib
import shutil
import signal
import subprocess
import threading
import time
import unittest

import zmq

from fake_feed import FakeFeed, description_pb2
from harness import SOURCE, Desk, free_port, synthetic_volume, until

NATS = shutil.which("nats-server", path=f"{os.environ['PATH']}:/usr/sbin")
if not NATS or not shutil.which("openssl"):
    raise SystemExit(77)

LONG_S = 180  # a limit that a loaded machine meets
RECEIVERS = {"python": ["/usr/bin/python3", SOURCE / "tools/bridges/relay/receive.py"]}
if shutil.which("node"):
    RECEIVERS["javascript"] = ["node", SOURCE / "tools/bridges/relay/receive.mjs"]


def openssl(folder, *arguments):
    subprocess.run(["openssl", *map(str, arguments)], cwd=folder, check=True, capture_output=True)


def make_authority(folder):
    """ca.pem, and a certificate server.pem that it signed for localhost and 127.0.0.1."""
    key = ("-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256", "-nodes")
    openssl(folder, "req", "-x509", *key, "-keyout", "ca.key", "-out", "ca.pem", "-days", 30, "-subj", "/CN=authority of a test")
    openssl(folder, "req", "-x509", *key, "-keyout", "other.key", "-out", "other.pem", "-days", 30, "-subj", "/CN=another authority")
    openssl(folder, "req", *key, "-keyout", "server.key", "-out", "server.csr", "-subj", "/CN=server of a test")
    (folder / "names").write_text("subjectAltName=DNS:localhost,IP:127.0.0.1\n")
    openssl(folder, "x509", "-req", "-in", "server.csr", "-CA", "ca.pem", "-CAkey", "ca.key", "-CAcreateserial", "-out", "server.pem",
            "-days", 30, "-extfile", "names")


class Receiver:
    """Runs one of the receivers, and keeps its poses by frame number."""

    def __init__(self, desk, command):
        self.poses, self.newest, self.count = {}, None, 0
        self.log = open(desk.folder / f"receiver.{time.monotonic_ns()}.log", "w+")
        self.process = subprocess.Popen([*map(str, command)], stdout=subprocess.PIPE, stderr=self.log)
        self.thread = threading.Thread(target=self._read, daemon=True)
        self.thread.start()
        desk.callback(self.end)

    def _read(self):
        for line in self.process.stdout:
            pose = json.loads(line)
            self.poses[pose["number"]] = self.newest = pose
            self.count += 1

    def end(self):
        self.process.kill()
        self.process.wait()
        self.thread.join()
        self.process.stdout.close()
        self.log.close()

    def output(self):
        return pathlib.Path(self.log.name).read_text()


def degrees_between(one, other):
    apart = min(math.dist(one, other), math.dist(one, [-value for value in other]))
    return math.degrees(4 * math.asin(apart / 2))


class Relay(unittest.TestCase):
    def setUp(self):
        self.desk = Desk()
        self.addCleanup(self.desk.close)
        make_authority(self.desk.folder)
        self.port = free_port()
        self.login = self.desk.write("relay.pass", "relay:secret\n")
        self.login.chmod(0o600)
        self.server = None

    def start_server(self, tls=True):
        config = [f"listen: 127.0.0.1:{self.port}", "authorization { user: relay, password: secret }"]
        if tls:
            config.append(f"tls {{ cert_file: {self.desk.folder}/server.pem, key_file: {self.desk.folder}/server.key }}")
        path = self.desk.write("nats.conf", "\n".join(config) + "\n")
        self.server = self.desk.start(NATS, "-c", path)
        until(lambda: "Server is ready" in self.server.output(), "nats-server is ready", LONG_S)

    def relay(self, endpoint, *more, server=None, ca="ca.pem"):
        return self.desk.start("mocap-relay", endpoint, "--server", server or f"tls://127.0.0.1:{self.port}", "--ca", self.desk.folder / ca,
                               "--credentials", self.login, *more)

    def receive(self, which, *more):
        server = [f"tls://127.0.0.1:{self.port}", "--ca", self.desk.folder / "ca.pem", "--credentials", self.login, "--json"]
        return Receiver(self.desk, [*RECEIVERS[which], *server, *more])

    def daemon(self):
        return self.desk.start("mocapd", "--config", self.desk.write("my.toml", synthetic_volume(self.desk.endpoint)))

    def came(self, receiver, program, more=20):
        """Waits for further poses of a tracked subject."""
        count = receiver.count
        try:
            until(lambda: receiver.count >= count + more and receiver.newest["phase"] == "tracking", "poses", LONG_S)
        except AssertionError as missing:
            raise AssertionError(f"{missing}; relay: {program.output()}; receiver: {receiver.output()}") from None

    def test_poses_are_those_of_the_feed_and_come_back_after_restarts(self):
        self.start_server()
        daemon = self.daemon()
        relay = self.relay(self.desk.endpoint)
        receivers = {which: self.receive(which) for which in RECEIVERS}
        for receiver in receivers.values():
            self.came(receiver, relay)
        lines = self.desk.run("mocap-watch", self.desk.endpoint, "--json", "--seconds", 4).stdout.splitlines()
        names = self.bone_names()
        for which, receiver in receivers.items():
            with self.subTest(which):
                self.assertEqual(receiver.output(), "")
                self.compare(lines, names, receiver.poses)

        self.server.end()
        until(lambda: "no NATS server answers" in relay.output(), "the relay says that the server is gone", LONG_S)
        self.start_server()
        for receiver in receivers.values():
            self.came(receiver, relay)

        daemon.end()
        for receiver in receivers.values():
            receiver.poses.clear()
        self.daemon()
        for which, receiver in receivers.items():
            self.came(receiver, relay)
            # The new run begins without poses, and these messages were read, too.
            self.assertTrue(any(pose["phase"] == "searching" and not pose["bones"] for pose in receiver.poses.values()), which)

        self.assertEqual(relay.output().count("no NATS server answers"), 1, relay.output())  # once, not at every attempt
        relay.send(signal.SIGTERM)
        self.assertEqual(relay.wait(LONG_S), 0)

    def bone_names(self):
        with zmq.Context() as context, context.socket(zmq.SUB) as socket:
            socket.linger = 0
            socket.connect(self.desk.endpoint)
            socket.subscribe(b"description\0")
            self.assertTrue(socket.poll(LONG_S * 1000))
            said = description_pb2.Description.FromString(socket.recv().split(b"\0", 1)[1])
        return [bone.name for bone in said.subjects[0].bones]

    def compare(self, lines, names, poses):
        """The poses of the receiver against the snapshots of the same numbers: within 0.1 degrees and 1 mm."""
        compared = 0
        for line in lines:
            snapshot = json.loads(line)
            bones = snapshot.get("subjects", [{}])[0].get("bones")
            pose = poses.get(int(snapshot["number"]))
            if not bones or pose is None or pose["off_rest"]:
                continue
            compared += 1
            for i, name in enumerate(names):
                if bones["states"][i] == "BONE_STATE_LOST":
                    self.assertNotIn(name, pose["bones"])
                    continue
                found = pose["bones"][name]
                self.assertLess(degrees_between(found["rotation_xyzw"], bones["worldRotationsXyzw"][4 * i:4 * i + 4]), 0.1)
                self.assertIsNotNone(found["position_m"], name)
                self.assertLess(math.dist(found["position_m"], bones["worldPositionsM"][3 * i:3 * i + 3]), 0.001)
            exposed_ns = int(snapshot["instants"]["exposedAtNs"]) + int(snapshot["utcMinusHostNs"])
            self.assertAlmostEqual(int(pose["exposed_at_utc_ns"]), exposed_ns, delta=50e6)  # the clock of UTC is read once a second
        self.assertGreater(compared, 20)

    def test_a_server_that_stops_reading_gets_the_newest_afterwards(self):
        self.start_server(tls=False)
        feed = FakeFeed()
        self.addCleanup(feed.close)
        status = self.desk.folder / "status.json"
        relay = self.desk.start("mocap-relay", feed.endpoint, "--server", f"nats://127.0.0.1:{self.port}", "--credentials", self.login,
                                "--topic", "snapshot", "--status-file", status)

        def counts():
            return json.loads(status.read_text()) if status.exists() else {"sent": 0, "dropped": 0}

        until(lambda: counts()["sent"] > 50, "the relay sends", LONG_S)
        self.server.send(signal.SIGSTOP)
        dropped = counts()["dropped"]
        until(lambda: counts()["dropped"] > dropped + 200, "the relay drops what the server does not read", LONG_S)
        sent = counts()["sent"]
        until(lambda: counts()["dropped"] > dropped + 300, "the relay goes on to drop", LONG_S)
        self.assertEqual(counts()["sent"], sent)  # nothing piles up in the kernel
        self.server.send(signal.SIGCONT)

        until(lambda: counts()["sent"] > sent + 50, "the relay sends again", LONG_S)
        listed = self.desk.run("mocapctl", "bridge", "list", "--folder", self.desk.folder).stdout
        self.assertIn("mocap-relay: 1 receiver", listed)
        self.assertIn(f"nats://127.0.0.1:{self.port}", listed)

    def test_says_in_one_sentence_why_nothing_is_forwarded(self):
        feed = FakeFeed()
        self.addCleanup(feed.close)
        relay = self.relay(feed.endpoint, "--seconds", 6)
        self.assertEqual(relay.wait(LONG_S), 69)
        self.assertEqual(relay.output().count("\n"), 1, relay.output())
        self.assertIn(f"no NATS server answers at tls://127.0.0.1:{self.port}: start it", relay.output())

        self.start_server()
        relay = self.relay(feed.endpoint, "--seconds", 6, ca="other.pem")
        self.assertEqual(relay.wait(LONG_S), 69)
        self.assertEqual(relay.output().count("\n"), 1, relay.output())
        self.assertIn("does not show a certificate for '127.0.0.1' that --ca or the system trusts", relay.output())

        self.login.write_text("relay:wrong\n")
        relay = self.relay(feed.endpoint, "--seconds", 6)
        self.assertEqual(relay.wait(LONG_S), 69)
        self.assertEqual(relay.output().count("\n"), 1, relay.output())
        self.assertIn("refuses the credentials", relay.output())

    def test_a_signal_before_anything_was_forwarded_is_no_failure(self):
        feed = FakeFeed()
        self.addCleanup(feed.close)
        relay = self.relay(feed.endpoint)
        until(lambda: "no NATS server answers" in relay.output(), "the relay runs", LONG_S)

        relay.send(signal.SIGTERM)

        self.assertEqual(relay.wait(LONG_S), 0)

    def test_refuses_a_server_without_tls(self):
        feed = FakeFeed()
        self.addCleanup(feed.close)
        self.start_server(tls=False)
        relay = self.relay(feed.endpoint, "--seconds", 6)

        self.assertEqual(relay.wait(LONG_S), 69)
        self.assertIn("has no TLS", relay.output())

    def test_refuses_wrong_options(self):
        cases = [
            (["tcp://127.0.0.1:1"], "--server is required"),
            (["--server", "nats://192.0.2.1"], "has no TLS: use tls://192.0.2.1:4222, or give --insecure"),
            (["--server", "http://host"], "expected tls://HOST[:PORT] or nats://HOST[:PORT]"),
            (["--server", "nats://127.0.0.1", "--ca", self.desk.folder / "ca.pem"], "--ca is for TLS"),
            (["--server", "tls://127.0.0.1", "--ca", self.login], "cannot be read as certificates"),
            (["--server", "127.0.0.1", "--prefix", "a b"], "--prefix 'a b'"),
            (["--server", "127.0.0.1", "--topic", "poses"], "--topic 'poses'"),
            (["--server", "127.0.0.1", "--credentials", "/nowhere"], "/nowhere: no such file"),
        ]
        for arguments, fault in cases:
            with self.subTest(fault):
                ended = self.desk.run("mocap-relay", *arguments)

                self.assertEqual(ended.returncode, 64, ended.stderr)
                self.assertIn(fault, ended.stderr)
        self.login.chmod(0o644)
        self.assertIn("mode 0644", self.desk.run("mocap-relay", "--server", "127.0.0.1", "--credentials", self.login).stderr)


if __name__ == "__main__":
    unittest.main(verbosity=2)
