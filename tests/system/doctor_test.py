"""mocap-watch --doctor with real sockets that each have one fault: one line with a remedy, and an exit code for each fault."""

import contextlib
import socket
import threading
import unittest

import zmq

from fake_feed import SEARCHING, SILENT, STOPPED, STREAMING, FakeFeed
from harness import Desk, free_port


class Doctor(unittest.TestCase):
    def setUp(self):
        self.desk = Desk()
        self.addCleanup(self.desk.close)

    def feed(self, **options):
        feed = FakeFeed(**options)
        self.addCleanup(feed.close)
        return feed

    def assert_says(self, endpoint, exit_code, *words, keys=()):
        ended = self.desk.run("mocap-watch", "--doctor", endpoint, *keys)
        said = ended.stdout + ended.stderr
        self.assertEqual(ended.returncode, exit_code, said)
        self.assertEqual(len(said.splitlines()), 1, said)
        for word in words:
            self.assertIn(word, said)

    def test_no_fault(self):
        self.assert_says(self.feed().endpoint, 0, "all is well", "cameras 4 of 4")

    def test_nothing_listens(self):
        self.assert_says(f"tcp://127.0.0.1:{free_port()}", 11, "nothing listens", "start mocapd")

    def test_another_program_listens(self):
        listener = socket.socket()
        self.addCleanup(listener.close)
        listener.bind(("127.0.0.1", 0))
        listener.listen()

        def hang_up():
            with contextlib.suppress(OSError):
                while True:
                    peer, _ = listener.accept()
                    peer.sendall(b"HTTP/1.1 400 Bad Request\r\n\r\n" + b" " * 100)
                    peer.close()

        threading.Thread(target=hang_up, daemon=True).start()
        self.assert_says(f"tcp://127.0.0.1:{listener.getsockname()[1]}", 12, "is not a mocapd", "compare the port")

    def test_another_kind_of_zeromq_socket_listens(self):
        context = zmq.Context()
        self.addCleanup(context.destroy, linger=0)
        answers = context.socket(zmq.REP)
        port = answers.bind_to_random_port("tcp://127.0.0.1")
        self.assert_says(f"tcp://127.0.0.1:{port}", 12, "is not a mocapd")

    def test_each_fault_of_the_keys_has_its_own_exit_code(self):
        server, ours, others = (tuple(key.decode() for key in zmq.curve_keypair()) for _ in range(3))
        feed = self.feed(keys=[key.encode() for key in server], allowed={ours[0].encode()})

        def keys(server_key, pair):
            file = self.desk.write("own.key", f"# a comment\npublic {pair[0]}\nsecret {pair[1]}\n")
            return "--server-key", server_key, "--secret-key", file

        in_a_file = self.desk.write("server.key", f"public {server[0]}\n")
        self.assert_says(feed.endpoint, 0, "all is well", keys=keys(server[0], ours))
        self.assert_says(feed.endpoint, 0, "all is well", keys=keys(in_a_file, ours))
        self.assert_says(feed.endpoint, 13, "requires a key", "mocapctl keys new")
        self.assert_says(feed.endpoint, 14, "does not know the public key of this client", "mocapctl keys allow", keys=keys(server[0], others))
        self.assert_says(feed.endpoint, 15, "does not have the server key of this client", keys=keys(others[0], ours))
        self.assert_says(feed.endpoint, 64, "server_key is neither a key", keys=("--server-key", "short"))

    def test_no_description(self):
        self.assert_says(self.feed(describes=False).endpoint, 16, "sends no description")

    def test_version_too_new(self):
        self.assert_says(self.feed(protocol="mocap.v2").endpoint, 17, "mocap.v2", "update this client")

    def test_cameras_silent(self):
        feed = self.feed(cameras={"north": STREAMING, "south-east": SILENT})
        self.assert_says(feed.endpoint, 18, "no images from south-east", "cables")
        feed = self.feed(cameras={"north": SILENT}, rate_hz=0)
        self.assert_says(feed.endpoint, 18, "no images from north")

    def test_capture_stopped(self):
        feed = self.feed(cameras={"north": STOPPED}, rate_hz=0)
        self.assert_says(feed.endpoint, 19, "the capture there was stopped", "start it again")

    def test_subject_searching(self):
        self.assert_says(self.feed(phase=SEARCHING).endpoint, 20, "no subject is identified", "T-pose")

    def test_clock_skew(self):
        self.assert_says(self.feed(utc_error_ns=10_000_000_000).endpoint, 21, "ms ahead of this machine", "time server")
        self.assert_says(self.feed(utc_error_ns=-10_000_000_000).endpoint, 21, "time server")


if __name__ == "__main__":
    unittest.main(verbosity=2)
