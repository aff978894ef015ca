"""A camera is bumped during a capture: the daemon reports it in log and health, mocap-calibrate refine corrects the rig from
the daemon's recording, and the camera agrees with the rig after a reload. The cameras are simulated (GigE Vision); one is
stopped and restarted with another pose."""

import json
import math
import re
import shutil
import time
import tomllib
import unittest

from harness import GIGE, SOURCE, Desk

CONFIG = """
[capture]
rig = "rig.toml"

[publish]
endpoint = "{endpoint}"

[record]
blobs = "take.blobs"

[[subject]]
name = "actor"
marker_set = "{source}/config/markersets/baseline41.toml"
"""

RIG = SOURCE / "config/demo.rig.toml"
BUMPED = "cam3"
TURN_DEG, MOVE_M = 0.3, 0.005


def quaternion_of(r):
    """Returns the quaternion (w first) of a Rodrigues vector."""
    angle = math.sqrt(sum(x * x for x in r))
    s = math.sin(angle / 2) / angle if angle > 0 else 0.5
    return [math.cos(angle / 2), *(s * x for x in r)]


def product(a, b):
    return [
        a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
        a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
        a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
        a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0],
    ]


def rotated(q, v):
    return product(product(q, [0.0, *v]), [q[0], -q[1], -q[2], -q[3]])[1:]


def centre(camera):
    q = quaternion_of(camera["rotation"])
    return [-x for x in rotated([q[0], -q[1], -q[2], -q[3]], camera["translation"])]


def bump(text, name, deg, move_m):
    """Returns the text of the rig file with one camera rotated about an oblique axis of its own frame, and translated."""
    camera = tomllib.loads(text)[name]
    axis = [x / math.sqrt(1.0 + 4.0 + 0.25) for x in (1.0, 2.0, 0.5)]
    q = product(quaternion_of([math.radians(deg) * x for x in axis]), quaternion_of(camera["rotation"]))
    at = [a + move_m * b for a, b in zip(centre(camera), (0.6, 0.0, 0.8))]
    sine = math.sqrt(sum(x * x for x in q[1:]))
    angle = 2 * math.atan2(sine, q[0])
    rotation = [angle * x / sine for x in q[1:]]
    translation = [-x for x in rotated(quaternion_of(rotation), at)]
    before, own = text.split(f"[{name}]\n")
    own = re.sub(r"rotation = \[.*\]", f"rotation = {rotation}", own, count=1)
    own = re.sub(r"translation = \[.*\]", f"translation = {translation}", own, count=1)
    return f"{before}[{name}]\n{own}"


class BumpedCamera(unittest.TestCase):
    def setUp(self):
        self.desk = Desk()
        self.addCleanup(self.desk.close)
        shutil.copy(RIG, self.desk.folder / "rig.toml")
        self.truth = self.desk.write("truth.toml", bump(RIG.read_text(), BUMPED, TURN_DEG, MOVE_M))
        self.epoch_ns = time.monotonic_ns()
        feed, port = self.desk.endpoint.rsplit(":", 1)
        self.control = f"{feed}:{int(port) + 1}"

    def serve(self, number, rig):
        """Serves one camera; all cameras show the same motion whenever they were started."""
        return self.desk.start("mocap-sim", "--serve", "--rig", rig, "--only", number, "--fps", "30", "--motion",
                               "tpose:2,walk", "--marker-set", SOURCE / "config/markersets/baseline41.toml",
                               "--epoch", self.epoch_ns)

    def wait_for_log(self, program, words, timeout_s=60, after=0):
        limit = time.monotonic() + timeout_s
        while words not in program.output()[after:]:
            self.assertIsNone(program.process.poll(), program.output())
            self.assertLess(time.monotonic(), limit, f"not said within {timeout_s} s: {words}\n{program.output()[after:]}")
            time.sleep(0.02)

    def health(self):
        path = self.desk.folder / "summary.json"
        watched = self.desk.run("mocap-watch", self.desk.endpoint, "--seconds", "2.5", "--summary", path)
        self.assertEqual(watched.returncode, 0, watched.stderr)
        return json.loads(path.read_text())["cameras"]

    def until_seen(self, frames, timeout_s=60):
        """Waits until every camera has sent this number of images; returns the health."""
        limit = time.monotonic() + timeout_s
        while True:
            health = self.health()
            if len(health) == 4 and all(camera["frames"] >= frames for camera in health.values()):
                return health
            self.assertLess(time.monotonic(), limit, f"not {frames} images of each camera within {timeout_s} s: {health}")

    def until_none_differs(self, timeout_s=120):
        """Waits until no camera differs from the rig."""
        limit = time.monotonic() + timeout_s
        health = self.health()
        while len(health) < 4 or any(camera["bumped"] for camera in health.values()):
            self.assertLess(time.monotonic(), limit, f"a camera still differs after {timeout_s} s: {health}")
            health = self.health()

    def start_the_daemon(self):
        text = CONFIG.format(source=SOURCE, endpoint=self.desk.endpoint)
        text += "".join(GIGE.format(number=number, address=number + 1) for number in range(1, 5))
        self.config = self.desk.write("mocapd.toml", text)
        daemon = self.desk.start("mocapd", "--config", self.config)
        for number in range(1, 5):
            self.wait_for_log(daemon, f"camera cam{number}: streaming")
        return daemon

    def test_a_bumped_camera_is_reported_and_agrees_again_after_refinement(self):
        served = {number: self.serve(number, RIG) for number in range(1, 5)}
        daemon = self.start_the_daemon()
        before = self.until_seen(100)

        served[3].end()
        self.serve(3, self.truth)
        self.wait_for_log(daemon, f"camera {BUMPED}: streaming", after=daemon.output().rfind(f"camera {BUMPED}: "))
        self.wait_for_log(daemon, f"camera {BUMPED}: differs from the rig")
        named = self.health()
        self.until_seen(named[BUMPED]["frames"] + 200)
        held = self.desk.run("mocap-calibrate", "verify", "--config", self.config, "--seconds", "2")
        refined = self.desk.run("mocap-calibrate", "refine", "--blobs", "take.blobs", "--rig", "rig.toml")
        reloaded = self.desk.run("mocapctl", "reload", "--endpoint", self.control)
        self.wait_for_log(daemon, "configuration changed")
        self.until_none_differs()

        self.assertEqual([name for name, camera in before.items() if camera["bumped"]], [])
        self.assertEqual([name for name, camera in named.items() if camera["bumped"]], [BUMPED])
        self.assertGreater(named[BUMPED]["rig_off_px"], 1.0)
        self.assertEqual(held.returncode, 69, held.stderr)
        self.assertIn('if mocapd is running it holds the cameras: stop it, or record a take (mocapctl take start)', held.stderr)
        self.assertEqual(refined.returncode, 0, refined.stderr + refined.stdout)
        self.assertIn(f"camera {BUMPED}: was moved within the first", refined.stdout)
        self.assertRegex(refined.stdout, rf"camera {BUMPED}: was rotated by 0\.\d+ degrees")
        rig = tomllib.loads((self.desk.folder / "rig.toml").read_text())
        truth = tomllib.loads(self.truth.read_text())
        off_mm = {name: 1e3 * math.dist(centre(rig[name]), centre(truth[name])) for name in truth if name != "metadata"}
        self.assertLess(max(off_mm.values()), 0.5, off_mm)
        self.assertEqual(reloaded.returncode, 0, reloaded.stderr)


if __name__ == "__main__":
    unittest.main(verbosity=2)
