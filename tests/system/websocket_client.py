"""A small WebSocket client, written from RFC 6455: frames as bytes, so that tests can send malformed ones."""

import base64
import hashlib
import json
import os
import socket
import ssl
import struct

TEXT, BINARY, CLOSE, PING, PONG = 1, 2, 8, 9, 10


def frame(opcode, payload=b"", fin=True, masked=True, reserved=0, length=None):
    """The bytes of one frame. `length`: the length that the frame claims, if it is not that of its payload."""
    size = len(payload) if length is None else length
    head = bytes([(0x80 if fin else 0) | reserved << 4 | opcode])
    bit = 0x80 if masked else 0
    if size < 126:
        head += bytes([bit | size])
    elif size < 65536:
        head += bytes([bit | 126]) + struct.pack(">H", size)
    else:
        head += bytes([bit | 127]) + struct.pack(">Q", size)
    if not masked:
        return head + payload
    mask = os.urandom(4)
    return head + mask + bytes(byte ^ mask[i % 4] for i, byte in enumerate(payload))


class WebSocket:
    """One connection to /ws. `headers` replace or add headers of the handshake."""

    def __init__(self, port, headers=None, timeout_s=60, tls=None, path="/ws"):
        plain = socket.create_connection(("127.0.0.1", port), timeout_s)
        self.socket = tls.wrap_socket(plain, server_hostname="localhost") if tls else plain
        key = base64.b64encode(os.urandom(16)).decode()
        said = {"Host": f"127.0.0.1:{port}", "Upgrade": "websocket", "Connection": "Upgrade", "Sec-WebSocket-Key": key,
                "Sec-WebSocket-Version": "13", "Sec-WebSocket-Protocol": "mocap.v1"} | (headers or {})
        lines = [f"GET {path} HTTP/1.1", *(f"{name}: {value}" for name, value in said.items() if value is not None), "", ""]
        self.socket.sendall("\r\n".join(lines).encode())
        self._rest = b""
        head = self._until(b"\r\n\r\n").decode().split("\r\n")
        self.status = int(head[0].split()[1])
        self.headers = dict(line.lower().split(": ", 1) for line in head[1:] if line)
        if self.status == 101:
            wanted = base64.b64encode(hashlib.sha1((key + "258EAFA5-E914-47DA-95CA-C5AB0DC85B11").encode()).digest()).decode()
            accept = next(line.split(": ", 1)[1] for line in head[1:] if line.lower().startswith("sec-websocket-accept"))
            assert accept == wanted, (accept, wanted)

    def _until(self, end):
        while end not in self._rest:
            more = self.socket.recv(65536)
            if not more:
                raise ConnectionError(f"closed after {self._rest!r}")
            self._rest += more
        found, self._rest = self._rest.split(end, 1)
        return found

    def _bytes(self, count):
        while len(self._rest) < count:
            more = self.socket.recv(65536)
            if not more:
                raise ConnectionError("closed")
            self._rest += more
        found, self._rest = self._rest[:count], self._rest[count:]
        return found

    def send(self, message):
        """Sends an object as JSON text."""
        self.socket.sendall(frame(TEXT, json.dumps(message).encode()))

    def receive_frame(self):
        """The next frame: opcode and payload. The server never masks, fragments or compresses."""
        first, second = self._bytes(2)
        assert first & 0x70 == 0 and second & 0x80 == 0 and first & 0x80, (first, second)
        size = second & 0x7F
        if size == 126:
            (size,) = struct.unpack(">H", self._bytes(2))
        elif size == 127:
            (size,) = struct.unpack(">Q", self._bytes(8))
        return first & 0x0F, self._bytes(size)

    def receive(self):
        """The next message: an object (text) or (topic, payload). Pings are answered."""
        while True:
            opcode, payload = self.receive_frame()
            if opcode == PING:
                self.socket.sendall(frame(PONG, payload))
            elif opcode == TEXT:
                return json.loads(payload)
            elif opcode == BINARY:
                return payload[1:1 + payload[0]].decode(), payload[1 + payload[0]:]
            elif opcode == CLOSE:
                raise ConnectionError(f"closed: {payload!r}")

    def wait_for(self, holds):
        """The next message for which `holds` is true."""
        while True:
            message = self.receive()
            if holds(message):
                return message

    def wait_for_topic(self, topic):
        return self.wait_for(lambda message: isinstance(message, tuple) and message[0] == topic)[1]

    def wait_for_text(self, key):
        return self.wait_for(lambda message: isinstance(message, dict) and key in message)[key]

    def ask(self, number, method, params=None):
        self.send({"request": {"id": number, "method": method, "params": params or {}}})
        return self.wait_for(lambda message: isinstance(message, dict) and message.get("answer", {}).get("id") == number)["answer"]

    def wait_for_end(self):
        """Reads until the server ends the connection. Returns the code of its close frame, if it sent one."""
        code = None
        try:
            while True:
                opcode, payload = self.receive_frame()
                if opcode == CLOSE and len(payload) >= 2:
                    (code,) = struct.unpack(">H", payload[:2])
        except (ConnectionError, AssertionError):
            return code

    def close(self):
        self.socket.close()


def trust(certificate):
    """A TLS context that trusts this certificate alone."""
    context = ssl.create_default_context(cafile=certificate)
    return context
