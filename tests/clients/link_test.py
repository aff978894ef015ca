"""The Python client names the fault of a connection that a program closes before the handshake has said why."""

import os
import pathlib
import sys
import time
import unittest

import zmq
from accepting_server import AcceptingServer

BUILD = pathlib.Path(os.environ.get("MOCAP_BUILD_DIR", "build/release")).resolve()
ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "tools/clients/python"), str(BUILD / "python")]

from mocap_client.link import Fault, Link  # noqa: E402

LIMIT_S = 60  # of a failing test


class ClosesFirst(AcceptingServer):
    """A program that speaks ZMTP with this mechanism, but closes each connection that sends more than signature and version."""

    def __init__(self, mechanism):
        self._greeting = b"\xff\0\0\0\0\0\0\0\1\x7f\3\0" + mechanism.ljust(20, b"\0")
        super().__init__(self._greet)
        self.endpoint = f"tcp://127.0.0.1:{self.port}"

    def _greet(self, peer):
        received = 0
        with peer:
            peer.sendall(self._greeting[:12])
            while received <= 12 and (part := peer.recv(64)):
                received += len(part)
                if received == 12:  # the question for the greeting has no more
                    peer.sendall(self._greeting[12:])


class LinkFaults(unittest.TestCase):
    def expect(self, fault, mechanism, keys):
        program = ClosesFirst(mechanism)
        self.addCleanup(program.close)
        link = Link(zmq.DEALER, program.endpoint, keys)
        self.addCleanup(link.close)
        limit = time.monotonic() + LIMIT_S
        while link.fault != fault and time.monotonic() < limit:
            time.sleep(0.002)
            link.watch()
            if link.gave_up():
                link.open()
        self.assertEqual(link.fault, fault)

    def test_the_greeting_tells_what_the_closed_connection_does_not(self):
        keys = (zmq.curve_keypair()[0], *zmq.curve_keypair())
        self.expect(Fault.KEY_MISSING, b"CURVE", None)
        self.expect(Fault.SERVER_KEY_WRONG, b"CURVE", keys)
        self.expect(Fault.NOT_A_DAEMON, b"NULL", None)
        self.expect(Fault.KEY_NOT_WANTED, b"NULL", keys)


if __name__ == "__main__":
    unittest.main(verbosity=2)
