"""Runs the programs as a user does: real processes, real sockets, files in a temporary folder."""

import contextlib
import json
import os
import pathlib
import signal
import socket
import subprocess
import tempfile
import threading
import time

_PORTS = iter(range(20000, 30000, 2))
SOURCE = pathlib.Path(__file__).resolve().parents[2]
BIN = pathlib.Path(os.environ.get("MOCAP_BIN_DIR", SOURCE / "build/release/bin"))


# Configuration tables of one camera each.
REPLAY = """
[[camera]]
name = "cam{number}"
driver = "replay"
folder = "{folder}/cam{number}"
speed = 0
"""

GIGE = """
[[camera]]
name = "cam{number}"
driver = "aravis"
address = "127.0.0.{address}"
packet_socket = false
packet_size_bytes = 8000
"""

# As the simulated cameras of config/demo.rig.toml. Further keys may follow.
GIGE_OF_DEMO_RIG = GIGE + """width_px = 640
height_px = 480
rate_hz = 30
exposure_us = 500
"""


def until(holds, what, timeout_s=120):
    """Waits until `holds` returns something true, and returns it. `what`: for the message of a failure."""
    limit = time.monotonic() + timeout_s
    while not (value := holds()):
        if time.monotonic() > limit:
            raise AssertionError(f"not within {timeout_s} s: {what}")
        time.sleep(0.05)
    return value


# For a machine with other load. The queue to a take has 32 snapshots in any case.
LONG_QUEUES = """
[queues]
camera_frames = 512
publish_snapshots = 512
side_snapshots = 512
"""


def synthetic_volume(endpoint, lossless=False):
    """Returns a configuration with one actor and four synthetic cameras, which need no network. `lossless`: a thread of the
    daemon that is late works through every set, so that a set that is missing was lost."""
    every_set, every_snapshot, queues = ("every_set = true", "every_snapshot = true", LONG_QUEUES) if lossless else ("",) * 3
    marker_set = SOURCE / "config/markersets/openmocap18.toml"
    return f"""
[capture]
rig = "{SOURCE}/config/demo.rig.toml"
{every_set}
[[subject]]
name = "actor"
marker_set = "{marker_set}"
[publish]
endpoint = "{endpoint}"
{every_snapshot}
{queues}""" + "".join(f"""
[[camera]]
name = "cam{number}"
driver = "synthetic"
rate_hz = 30
marker_set = "{marker_set}"
""" for number in range(1, 5))


def free_port():
    """Returns the lower of two free neighbouring ports, for the feed and for control. The ports are below the range of
    ports that the kernel assigns to outgoing connections: a recently closed one of those would block the daemon's bind.
    """
    for port in _PORTS:
        with socket.socket() as feed, socket.socket() as control, contextlib.suppress(OSError):
            feed.bind(("127.0.0.1", port))
            control.bind(("127.0.0.1", port + 1))
            return port


class Program:
    """A running program; its output goes to a log file."""

    def __init__(self, folder, *arguments, stdout=None):
        name = pathlib.Path(arguments[0]).name
        self.log = folder / f"{name}.{time.monotonic_ns()}.log"
        self._log_file = open(self.log, "wb")
        self.process = subprocess.Popen(
            [str(BIN / arguments[0]), *map(str, arguments[1:])],
            stdout=stdout if stdout is not None else self._log_file,
            stderr=self._log_file,
            cwd=folder,
        )

    def send(self, number):
        self.process.send_signal(number)

    def wait(self, timeout_s):
        return self.process.wait(timeout_s)

    def end(self):
        if self.process.poll() is None:
            self.process.terminate()
            with contextlib.suppress(subprocess.TimeoutExpired):
                self.process.wait(5)
            if self.process.poll() is None:
                self.process.kill()
                self.process.wait()
        self._log_file.close()

    def output(self):
        return self.log.read_text(errors="replace")


class Feed:
    """The snapshots that `mocap-watch --json` prints; keeps the newest."""

    def __init__(self, folder, endpoint):
        self.program = Program(folder, "mocap-watch", endpoint, "--json", "--seconds", "600", stdout=subprocess.PIPE)
        self.count = 0
        self.newest = None
        self._changed = threading.Condition()
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self):
        for line in self.program.process.stdout:
            snapshot = json.loads(line)
            with self._changed:
                self.count += 1
                self.newest = snapshot
                self._changed.notify_all()

    def wait_for(self, holds, timeout_s, what):
        """Returns the first snapshot from now on for which `holds` is true."""
        limit = time.monotonic() + timeout_s
        with self._changed:
            seen = self.count
            while True:
                left = limit - time.monotonic()
                if left <= 0 or not self._changed.wait(left):
                    raise AssertionError(f"not within {timeout_s} s: {what}; {self.count - seen} snapshots came, last: {self.newest}")
                if self.newest is not None and holds(self.newest):
                    return self.newest

    def end(self):
        self.program.process.kill()
        self._reader.join()
        self.program.process.stdout.close()
        self.program.end()


class Desk(contextlib.ExitStack):
    """A temporary folder and the programs started in it. At its end the programs are stopped and the folder is removed."""

    def __init__(self):
        super().__init__()
        self.folder = pathlib.Path(self.enter_context(tempfile.TemporaryDirectory(prefix="mocap-test-")))
        self.endpoint = f"tcp://127.0.0.1:{free_port()}"

    def start(self, *arguments):
        program = Program(self.folder, *arguments)
        self.callback(program.end)
        return program

    def watch(self):
        feed = Feed(self.folder, self.endpoint)
        self.callback(feed.end)
        return feed

    def run(self, *arguments, timeout_s=300):
        return subprocess.run(
            [str(BIN / arguments[0]), *map(str, arguments[1:])],
            cwd=self.folder, capture_output=True, text=True, timeout=timeout_s,
        )

    def write(self, name, text):
        path = self.folder / name
        path.write_text(text)
        return path
