"""Asks a program which security it uses, as daemon/wire/peer_greeting.h does: ZMTP's greeting (RFC 37/ZMTP) names its mechanism."""

import contextlib
import enum

import zmq

OURS = b"\xff\0\0\0\0\0\0\0\1\x7f\3\0"  # signature, version 3.0: the program then sends its own greeting
UNTIL_MECHANISM, LENGTH, OLDEST_MAJOR = 12, 32, 3
RECONNECT_MS = 3_600_000  # longer than any question; with -1, ZeroMQ 4.3 loses what a program sent before it closed the connection


class Greeting(enum.Enum):
    NOT_ZEROMQ = enum.auto()
    WITHOUT_KEYS = enum.auto()
    WITH_KEYS = enum.auto()


def mechanism(received):
    """What the bytes of a greeting say; None: not enough yet."""
    if (received and received[0] != 0xff) or (len(received) > 9 and received[9] & 1 == 0) or (len(received) > 10 and received[10] < OLDEST_MAJOR):
        return Greeting.NOT_ZEROMQ
    if len(received) < LENGTH:
        return None
    return Greeting.WITHOUT_KEYS if received[UNTIL_MECHANISM:LENGTH].rstrip(b"\0") == b"NULL" else Greeting.WITH_KEYS


class PeerGreeting:
    """One question to one endpoint, over a connection of its own. One thread at a time uses it."""

    def __init__(self, context):
        self._context = context
        self._stream = None

    def ask(self, endpoint):
        """Does nothing while an earlier question is open, and for endpoints other than tcp://ADDRESS:PORT."""
        if self._stream is not None or not endpoint.startswith("tcp://"):
            return
        self._stream, self._connected, self._received = self._context.socket(zmq.STREAM), False, b""
        for option, value in ((zmq.LINGER, 0), (zmq.RECONNECT_IVL, RECONNECT_MS), (zmq.IPV6, int(endpoint.startswith("tcp://[")))):
            self._stream.setsockopt(option, value)
        self._stream.connect(endpoint)

    def close(self):
        """Ends an open question."""
        if self._stream is not None:
            self._stream.close(linger=0)
        self._stream = None

    def read(self):
        """Processes what has arrived since the last call, without waiting. The answer once it is known, otherwise None."""
        while self._stream is not None:
            try:
                peer, part = self._stream.recv_multipart(zmq.DONTWAIT)
            except zmq.Again:
                return None
            if not part and self._connected:
                self.close()
            elif not part:
                self._connected = True
                with contextlib.suppress(zmq.ZMQError):  # the program has closed the connection
                    self._stream.send_multipart([peer, OURS], zmq.DONTWAIT)
            self._received += part
            if (answer := mechanism(self._received)) is not None:
                self.close()
                return answer
        return None
