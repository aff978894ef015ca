"""receive.py and receive.mjs of mocap-relay with a NATS server of this process, which sends what no honest server sends."""

import json
import pathlib
import shutil
import ssl
import struct
import subprocess
import tempfile
import threading
import unittest

from accepting_server import AcceptingServer

RELAY = pathlib.Path(__file__).resolve().parents[2] / "tools/bridges/relay"
RECEIVERS = {"python": ["/usr/bin/python3", RELAY / "receive.py"]}
if shutil.which("node"):
    RECEIVERS["javascript"] = ["node", RELAY / "receive.mjs"]
LIMIT_S = 120  # of a failing test


def field(number, value):
    """A field of Protobuf: an integer below 128, or bytes of at most 127."""
    return bytes((number << 3, value)) if isinstance(value, int) else bytes((number << 3 | 2, len(value))) + value


def message(subject, payload):
    return f"MSG {subject} 1 {len(payload)}\r\n".encode() + payload + b"\r\n"


def lite(number, layout=1):
    upright = (3 << 45 | 16384 << 30 | 16384 << 15 | 16384).to_bytes(6, "little")
    return message("mocap.studio.lite.actor", struct.pack("<BBBBIIQq", layout, 2, 1, 0, 1, number, number, 0) + bytes(9) + upright)


INFO = b'INFO {"tls_available": true}\r\n'
DESCRIPTION = message("mocap.studio.description", field(2, 1) + field(8, field(1, b"actor") + field(4, field(1, b"Hips"))))


class Server(AcceptingServer):
    """Sends `first` to each client, then with `context` goes on over TLS, answers CONNECT, and sends `then`."""

    def __init__(self, first, then=b"", context=None):
        self._first, self._then, self._context = first, then, context
        super().__init__(self._answer)

    def _answer(self, client):
        try:
            client.sendall(self._first)
            if self._context is not None:
                client = self._context.wrap_socket(client, server_side=True)
            with client:
                client.recv(65536)
                client.sendall(b"PONG\r\n" + self._then)
                while client.recv(65536):
                    pass
        except OSError:
            pass  # the client has left


class Receivers(unittest.TestCase):
    def server(self, first, **options):
        server = Server(first, **options)
        self.addCleanup(server.close)
        return server

    def first_line(self, which, *arguments):
        """The first line that the receiver prints, on standard output or on standard error."""
        command = [*map(str, RECEIVERS[which]), *map(str, arguments), "--json"]
        with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True) as receiver:
            limit = threading.Timer(LIMIT_S, receiver.kill)
            limit.start()
            line = receiver.stdout.readline()
            limit.cancel()
            receiver.kill()
        return line

    def test_believe_nothing_that_came_before_tls(self):
        if not shutil.which("openssl"):
            self.skipTest("needs openssl")
        with tempfile.TemporaryDirectory() as folder:
            subprocess.run(["openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256", "-nodes", "-keyout", "key.pem",
                            "-out", "server.pem", "-subj", "/CN=server of a test", "-addext", "subjectAltName=IP:127.0.0.1"],
                           cwd=folder, check=True, capture_output=True)
            context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
            context.load_cert_chain(f"{folder}/server.pem", f"{folder}/key.pem")
            forged = DESCRIPTION + lite(1)
            cases = {"before the greeting": (forged + INFO, "does not begin with INFO"),
                     "behind the greeting": (INFO + b"PONG\r\n" + forged, "bytes came before TLS"),
                     "no": (INFO, None)}
            for which in RECEIVERS:
                for place, (first, fault) in cases.items():
                    with self.subTest(which, forged=place):
                        server = self.server(first, then=DESCRIPTION + lite(7), context=context)

                        line = self.first_line(which, f"tls://127.0.0.1:{server.port}", "--ca", f"{folder}/server.pem")

                        if fault is not None:
                            self.assertIn(fault, line)
                        else:
                            self.assertEqual(json.loads(line)["number"], 7)

    def test_discard_a_message_of_another_layout_and_keep_the_connection(self):
        for which in RECEIVERS:
            with self.subTest(which):
                server = self.server(INFO, then=DESCRIPTION + lite(1, layout=2) + lite(2))

                line = self.first_line(which, f"nats://127.0.0.1:{server.port}")

                self.assertEqual(json.loads(line)["number"], 2)
                self.assertEqual(server.connections, 1)


if __name__ == "__main__":
    unittest.main(verbosity=2)
