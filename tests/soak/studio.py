"""The programs of the soak: simulated GigE cameras in a network namespace of their own, at the other end of a cable; the daemon, the
page and a bridge in this one; takes on a small disk. Each program can be ended and started again."""

import pathlib
import signal
import subprocess
import sys
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "system"))
from feed_client import Operator, control_pb2  # noqa: E402
from harness import BIN, SOURCE, free_port  # noqa: E402

HERE, FIRST_CAMERA = "10.77.0.1", 11  # cameras have the addresses 10.77.0.11 and following
DISK_MB = 96

CONFIG = """
[capture]
rig = "{folder}/rig.toml"
every_set = true

[publish]
endpoint = "{endpoint}"
every_snapshot = true
send_queue = 1000  # a subscriber that waits for its turn on a busy machine misses nothing

[detect]
threshold = {threshold}

[takes]
folder = "disk"
min_free_mb = 2
before_s = 2
memory_mb = 8  # is full a minute after the start, so that memory that grows later is a leak

[[subject]]
name = "actor"
marker_set = "{source}/config/markersets/openmocap18.toml"
keep = "actor.toml"  # a daemon that starts again finds the walking person without a T-pose
"""

CAMERA = """
[[camera]]
name = "cam{number}"
driver = "aravis"
address = "10.77.0.{address}"
width_px = 640
height_px = 480
rate_hz = {rate}
exposure_us = 500
clock = "utc"
"""


def run(*command):
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True)
    if done.returncode != 0:
        raise SystemExit(f"soak: {' '.join(map(str, command))}: {done.stderr.strip()}")
    return done.stdout


class Studio:
    def __init__(self, folder, cameras, rate_hz):
        self.folder, self.cameras, self.rate_hz = folder, cameras, rate_hz
        self.endpoint, self.page_port, self.bridge_port = f"tcp://127.0.0.1:{free_port()}", free_port(), free_port()
        self.programs, self.began, self.threshold = {}, {}, 60
        self.state, self.disk = folder / "state", folder / "state/disk"
        self.disk.mkdir(parents=True)
        run("mount", "-t", "tmpfs", "-o", f"size={DISK_MB}m", "none", self.disk)
        run(BIN / "mocap-sim", "--ring", cameras, "--size", 640, 480, "--write-rig", folder / "rig.toml")
        self.camera_host = subprocess.Popen(["unshare", "--net", "sh", "-c", "echo there; exec sleep infinity"], stdout=subprocess.PIPE)
        if self.camera_host.stdout.readline() != b"there\n":
            raise SystemExit("soak: the system allows no second network namespace")
        self._connect()
        self._epoch = time.monotonic_ns()
        self.operator = Operator(self.endpoint)

    def _connect(self):
        other = self.camera_host.pid
        inside = ("nsenter", "-t", other, "-n", "ip")
        run("ip", "link", "add", "cable0", "mtu", 9000, "type", "veth", "peer", "name", "cable1", "mtu", 9000, "netns", other)
        run("ip", "addr", "add", f"{HERE}/24", "dev", "cable0")
        for number in range(self.cameras):
            run(*inside, "addr", "add", f"10.77.0.{FIRST_CAMERA + number}/24", "dev", "cable1")
        run(*inside, "link", "set", "lo", "up")
        run(*inside, "link", "set", "cable1", "up")
        run("ip", "link", "set", "cable0", "up")

    # --- programs by name: camera1..., mocapd, page, bridge ---

    def start_all(self):
        self.write_config()
        for number in range(1, self.cameras + 1):
            self.start(f"camera{number}")
        for name in ("mocapd", "page", "bridge"):
            self.start(name)

    def start(self, name):
        command = {
            "mocapd": ("mocapd", "--config", self.folder / "mocapd.toml", "--state", self.state),
            "page": ("mocap-web", self.endpoint, "--port", self.page_port),
            "bridge": ("mocap-vmc", self.endpoint, "--port", self.bridge_port),
        }.get(name) or self.camera_command(int(name.removeprefix("camera")))
        log = open(self.folder / f"{name}.log", "ab")
        self.programs[name] = subprocess.Popen([str(BIN / command[0]), *map(str, command[1:])], stdout=log, stderr=log, cwd=self.folder)
        self.began[name] = time.monotonic()
        log.close()

    def camera_command(self, number):
        return ("/usr/bin/nsenter", "-t", self.camera_host.pid, "-n", BIN / "mocap-sim", "--serve", "--rig", self.folder / "rig.toml",
                "--fps", self.rate_hz, "--only", number, "--first-address", f"10.77.0.{FIRST_CAMERA}", "--epoch", self._epoch)

    def kill(self, name):
        self.programs[name].kill()
        self.programs[name].wait()

    def ended(self):
        """The programs that ended by themselves."""
        return [name for name, process in self.programs.items() if process.poll() not in (None, -signal.SIGKILL)]

    def own_mb(self, name):
        """Private memory; nothing if the program does not run."""
        try:
            status = pathlib.Path(f"/proc/{self.programs[name].pid}/status").read_text()
            return next(int(line.split()[1]) for line in status.splitlines() if line.startswith("RssAnon")) / 1024
        except (OSError, StopIteration):
            return None

    def write_config(self):
        text = CONFIG.format(folder=self.folder, source=SOURCE, endpoint=self.endpoint, threshold=self.threshold)
        text += "".join(CAMERA.format(number=n, address=FIRST_CAMERA + n - 1, rate=self.rate_hz) for n in range(1, self.cameras + 1))
        (self.folder / "mocapd.toml").write_text(text)

    def health(self):
        answer = self.operator.order("status", timeout_s=2)
        return answer.status.health if answer and answer.status.HasField("health") else None

    def take(self, action):
        """Returns the answer's code and message; no code: no answer came."""
        answer = self.operator.order("take", timeout_s=20, action=action)
        return (answer.code, answer.message) if answer else (None, "no answer")

    def check_take(self, path):
        """"whole", "repaired" if it was cut off, or what is wrong."""
        if subprocess.run([BIN / "mocapctl", "take", "verify", path], capture_output=True, check=False).returncode == 0:
            return "whole"
        repaired = subprocess.run([BIN / "mocapctl", "take", "repair", path], capture_output=True, text=True, check=False)
        verified = subprocess.run([BIN / "mocapctl", "take", "verify", path], capture_output=True, text=True, check=False)
        return "repaired" if verified.returncode == 0 else f"damaged: {repaired.stderr}{verified.stdout}{verified.stderr}"

    def end(self):
        for process in self.programs.values():
            process.terminate()
        for process in self.programs.values():
            try:
                process.wait(10)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()
        self.camera_host.kill()
        self.camera_host.wait()
        subprocess.run(["umount", self.disk], check=False)


DONE = control_pb2.CODE_DONE
TAKE = control_pb2.TakeRequest
