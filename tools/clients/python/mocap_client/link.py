"""The connection of a client socket: follows ZeroMQ's socket monitor and finds the reason why there is no connection.

The faults, their sentences and the times between attempts are those of daemon/wire/client_link.h, which mocapctl and the C
library use.
"""

import enum
import struct
import time

import zmq
import zmq.utils.z85

from .greeting import Greeting, PeerGreeting

MECHANISM_MISMATCH = 0x11000002  # ZMQ_PROTOCOL_ERROR_ZMTP_MECHANISM_MISMATCH
EPIPE = 32
RETRY_AFTER_S = 0.5


class Fault(enum.Enum):
    NOTHING_LISTENS = enum.auto()
    NOT_A_DAEMON = enum.auto()
    CLOSED_BY_PEER = enum.auto()  # in the handshake with a client without keys; its greeting is not known
    KEY_MISSING = enum.auto()
    KEY_NOT_WANTED = enum.auto()
    KEY_REFUSED = enum.auto()
    SERVER_KEY_WRONG = enum.auto()


_CREATE = "create one with 'mocapctl keys new', allow it there, and give server_key and secret_key"
_SENTENCES = {
    Fault.NOTHING_LISTENS: "nothing listens at {at}: start mocapd, or compare address and port with {setting}",
    Fault.NOT_A_DAEMON: "the program at {at} is not a mocapd, or this is another of its ports: compare the port with {setting}",
    Fault.CLOSED_BY_PEER: "the program at {at} requires a key (" + _CREATE + "), or it is not a mocapd: compare the port with {setting}",
    Fault.KEY_MISSING: "{at} requires a key: " + _CREATE,
    Fault.KEY_NOT_WANTED: "{at} uses no keys: omit server_key and secret_key, or set [security] server_key there",
    Fault.KEY_REFUSED: "{at} does not know the public key of this client, or the key was revoked: allow it there with 'mocapctl keys allow'",
    Fault.SERVER_KEY_WRONG: "{at} does not have the server key of this client, or uses no keys: give server_key the public key in the file "
                            "of [security] server_key there; or this is another of its ports: compare the port with {setting}",
}


def explain(fault, endpoint, setting):
    """The fault and its remedy in one line. `setting`: the daemon's configuration key of the endpoint."""
    return _SENTENCES[fault].format(at=endpoint, setting=setting)


def _is_key(text):
    try:
        return len(text) == 40 and len(zmq.utils.z85.decode(text)) == 32
    except (KeyError, ValueError, struct.error):
        return False


def read_keys(server_key, secret_key, public_key):
    """Each is a key, or a file of mocapctl keys new that has it. Returns server, own public and own secret key, or None."""
    if server_key is None and secret_key is None and public_key is None:
        return None
    keys = []
    for name, key, word in (("server_key", server_key, "public"), ("public_key", secret_key if public_key is None else public_key, "public"),
                            ("secret_key", secret_key, "secret")):
        key = key.decode() if isinstance(key, bytes) else "" if key is None else str(key)
        if not _is_key(key):
            try:
                with open(key, encoding="utf-8") as file:
                    key = dict(line.split()[:2] for line in file if len(line.split()) >= 2)[word]
            except (OSError, KeyError):
                raise ValueError(f"{name} is neither a key (40 characters of Z85) nor a file of mocapctl keys with a line "
                                 f"'{word} KEY'") from None
        keys.append(key)
    return tuple(keys)


class Link:
    """A socket to one endpoint that is opened anew when ZeroMQ gives up, because a key may be allowed later. One thread at a
    time uses it."""

    def __init__(self, kind, endpoint, keys, options=(), topics=()):
        self.endpoint = endpoint
        self.connected = False
        self.since_ns = time.monotonic_ns()  # of the last change of `connected`
        self.connections = 0
        self.fault = None  # of the last failed attempt
        self._kind, self._keys, self._options, self._topics = kind, keys, options, topics
        self._context = zmq.Context()
        self._greeting = PeerGreeting(self._context)
        self._cause_known = False  # of `fault`
        self._failed_at = None  # of the newest socket
        self._handshake_running = False
        self.socket = self._monitor = None
        try:
            self.open()
        except zmq.ZMQError as fault:
            self.close()
            raise ValueError(f"endpoint {endpoint!r}: {fault}; expected tcp://ADDRESS:PORT or ipc://PATH") from fault

    def close(self):
        self._context.destroy(linger=0)

    def open(self):
        """Opens the socket, anew if it is open."""
        if self.socket is not None:
            self.socket.disable_monitor()
            self._monitor.close(linger=0)
            self.socket.close(linger=0)
            self._greeting.close()
            self._set_connected(False)
        self._failed_at, self._handshake_running = None, False
        self.socket = self._context.socket(self._kind)
        for option, value in ((zmq.LINGER, 0), (zmq.IPV6, int(self.endpoint.startswith("tcp://["))), *self._options):
            self.socket.setsockopt(option, value)
        if self._keys is not None:
            server, public, secret = (key.encode() if isinstance(key, str) else key for key in self._keys)
            self.socket.curve_serverkey, self.socket.curve_publickey, self.socket.curve_secretkey = server, public, secret
        for topic in self._topics:
            self.socket.subscribe(topic.encode() + b"\0")
        self._monitor = self.socket.get_monitor_socket(
            zmq.EVENT_CONNECTED | zmq.EVENT_DISCONNECTED | zmq.EVENT_CLOSED | zmq.EVENT_HANDSHAKE_SUCCEEDED |
            zmq.EVENT_HANDSHAKE_FAILED_NO_DETAIL | zmq.EVENT_HANDSHAKE_FAILED_PROTOCOL | zmq.EVENT_HANDSHAKE_FAILED_AUTH)
        self.socket.connect(self.endpoint)

    def watch(self):
        """Processes the events since the last call."""
        self._read_monitor()
        if (greeting := self._greeting.read()) is not None:
            self._note_greeting(greeting)

    def gave_up(self):
        """Whether to open the socket anew after a failed handshake: the next attempt may succeed, or reveal a more precise fault."""
        return self._failed_at is not None and time.monotonic() - self._failed_at > RETRY_AFTER_S

    def explain(self, setting):
        return explain(self.fault, self.endpoint, setting)

    def _set_connected(self, connected):
        if connected != self.connected:
            self.since_ns = time.monotonic_ns()
        self.connected = connected

    def _read_monitor(self):
        while True:
            try:
                event, _ = self._monitor.recv_multipart(zmq.DONTWAIT)
            except zmq.Again:
                return
            self._note(*struct.unpack("=HI", event[:6]))

    def _failed(self):
        self._handshake_running = False
        self._failed_at = time.monotonic()

    def _failed_for(self, cause):
        self._failed()
        self.fault, self._cause_known = cause, True
        self._greeting.close()

    def _failed_perhaps_for(self, likeliest):
        # A cause that is known stays until the greeting says otherwise.
        self._failed()
        if not self._cause_known:
            self.fault = likeliest
        self._greeting.ask(self.endpoint)

    def _settle(self, fault):  # the attempt has ended without a failed handshake
        self.fault, self._failed_at, self._cause_known, self._handshake_running = fault, None, False, False
        self._greeting.close()

    def _note_greeting(self, greeting):
        has_keys = self._keys is not None
        if greeting == Greeting.NOT_ZEROMQ:
            self.fault = Fault.NOT_A_DAEMON
        elif greeting == Greeting.WITHOUT_KEYS:
            self.fault = Fault.KEY_NOT_WANTED if has_keys else Fault.NOT_A_DAEMON
        elif self.fault != Fault.KEY_REFUSED:
            self.fault = Fault.SERVER_KEY_WRONG if has_keys else Fault.KEY_MISSING
        self._cause_known = True

    def _note(self, event, value):
        has_keys = self._keys is not None
        if event == zmq.EVENT_CONNECTED:
            self._handshake_running = True
        elif event == zmq.EVENT_HANDSHAKE_SUCCEEDED:
            self._set_connected(True)
            self.connections += 1
            self._settle(None)
        elif event == zmq.EVENT_DISCONNECTED:
            self._set_connected(False)
            if self._handshake_running:  # without an error: the peer is another type of ZeroMQ socket
                self._failed_perhaps_for(Fault.NOT_A_DAEMON)
        elif event == zmq.EVENT_CLOSED:
            self._settle(Fault.NOTHING_LISTENS)
        elif event == zmq.EVENT_HANDSHAKE_FAILED_AUTH:
            self._failed_for(Fault.KEY_REFUSED)
        elif event == zmq.EVENT_HANDSHAKE_FAILED_PROTOCOL:
            if value == MECHANISM_MISMATCH:
                self._failed_for(Fault.KEY_NOT_WANTED if has_keys else Fault.KEY_MISSING)
            else:
                self._failed_perhaps_for(Fault.NOT_A_DAEMON)
        elif event == zmq.EVENT_HANDSHAKE_FAILED_NO_DETAIL:
            closed = Fault.SERVER_KEY_WRONG if has_keys else Fault.CLOSED_BY_PEER
            self._failed_perhaps_for(closed if value == EPIPE else Fault.NOT_A_DAEMON)
