"""A daemon whose camera is unplugged and plugged in repeatedly, in a virtual machine (guest_vm.sh)."""

import json
import os
import pathlib
import statistics
import time
import unittest

from harness import SOURCE, Desk

CONFIG = """
[capture]
rig = "{rig}"

[publish]
endpoint = "{endpoint}"

[[subject]]
name = "actor"
marker_set = "{source}/config/markersets/openmocap18.toml"
"""

LIMIT_S = 60  # time limit of a failing test, sufficient on a slow machine


@unittest.skipUnless(os.environ.get("MOCAP_GUEST"), "needs the simulated devices of guest_vm.sh, which runs this test")
class Unplugging(unittest.TestCase):
    """Two cameras, cam1 and cam2; the tests unplug cam1."""

    def setUp(self):
        self.desk = Desk()
        self.addCleanup(self.desk.close)

    def daemon(self, width, height, *cameras):
        rig = self.desk.folder / "rig.toml"
        wrote = self.desk.run("mocap-sim", "--ring", 2, "--size", width, height, "--write-rig", rig)
        self.assertEqual(wrote.returncode, 0, wrote.stderr)
        text = CONFIG.format(rig=rig, source=SOURCE, endpoint=self.desk.endpoint) + "".join(cameras)
        return self.desk.start("mocapd", "--config", self.desk.write("mocapd.toml", text))

    def until(self, holds, program, what):
        limit = time.monotonic() + LIMIT_S
        while not holds():
            self.assertIsNone(program.process.poll(), program.output())
            self.assertLess(time.monotonic(), limit, f"not within {LIMIT_S} s: {what}\n{program.output()}")
            time.sleep(0.05)

    def wait_for_log(self, program, words, after=0):
        """Waits until the log has these words; returns the time of the log line in seconds of the day."""
        self.until(lambda: words in program.output()[after:], program, words)
        line = next(line for line in program.output()[after:].splitlines() if words in line)
        hours, minutes, seconds = line.split()[0].split(":")
        return 3600 * int(hours) + 60 * int(minutes) + float(seconds)

    def resources(self, program):
        proc = pathlib.Path(f"/proc/{program.process.pid}")
        status = dict(line.split(":", 1) for line in (proc / "status").read_text().splitlines())
        return {"files": len(os.listdir(proc / "fd")), "threads": int(status["Threads"]),
                "own_kb": int(status["RssAnon"].split()[0])}

    def health(self):
        path = self.desk.folder / "summary.json"
        watched = self.desk.run("mocap-watch", self.desk.endpoint, "--seconds", 3, "--summary", path)
        self.assertEqual(watched.returncode, 0, watched.stderr)
        return json.loads(path.read_text())["cameras"]

    def unplug_again_and_again(self, daemon, rounds, pull_out, put_in):
        """`put_in` must return at the moment when the device is present again."""
        for name in ("cam1", "cam2"):
            self.wait_for_log(daemon, f"camera {name}: streaming")
        before, held, took = None, None, []
        for number in range(rounds):
            seen = len(daemon.output())
            pull_out()
            self.wait_for_log(daemon, "error camera cam1:", seen)
            put_in()
            there = time.time() % 86400
            took.append((self.wait_for_log(daemon, "camera cam1: streaming", seen) - there) % 86400)
            if number == 1:  # first-time allocations remain
                before, held = self.health(), self.resources(daemon)
        after = self.health()
        self.until(lambda: self.resources(daemon)["threads"] <= held["threads"], daemon, "no thread more than before")
        now = self.resources(daemon)
        lost = after["cam2"]["missing_frames"] - before["cam2"]["missing_frames"]
        print(f"back {statistics.median(took):.2f} s after the device in the median, {max(took):.2f} s at the most, "
              f"of {rounds}; cam2 lost {lost} images; {held} -> {now}", flush=True)

        self.assertEqual(after["cam1"]["phase"], "streaming")
        self.assertGreaterEqual(after["cam1"]["reopened"], rounds)
        for count in ("failed_frames", "reopened"):
            self.assertEqual(after["cam2"][count], before["cam2"][count], count)
        self.assertLessEqual(now["files"], held["files"])
        # The daemon must release the camera's buffers and description, and the heap must not fragment further.
        self.assertLess(now["own_kb"] - held["own_kb"], 2048)
