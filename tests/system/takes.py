"""A daemon with a synthetic volume that records takes, for the tests of takes."""

import json
import unittest

from harness import Desk, synthetic_volume, until


class TakesTest(unittest.TestCase):
    def setUp(self):
        self.desk = Desk()
        self.addCleanup(self.desk.close)
        host, port = self.desk.endpoint.rsplit(":", 1)
        self.control = f"{host}:{int(port) + 1}"

    def config(self, more=""):
        text = synthetic_volume(self.desk.endpoint, lossless=True)
        return self.desk.write("mocapd.toml", f"{text}\n[takes]\nmin_free_mb = 1\n{more}\n")

    def daemon(self, more=""):
        daemon = self.desk.start("mocapd", "--config", self.config(more))
        self.wait_for_sets(30)
        return daemon

    def daemon_with_state(self):
        (self.desk.folder / "state").mkdir(exist_ok=True)
        daemon = self.desk.start("mocapd", "--config", self.config(), "--state", self.desk.folder / "state")
        self.wait_for_sets(30)
        return daemon

    def ctl(self, *arguments):
        return self.desk.run("mocapctl", *arguments, "--endpoint", self.control)

    def take(self, *arguments):
        """Runs mocapctl take, which must succeed; returns what it prints."""
        done = self.ctl("take", *arguments)
        self.assertEqual(done.returncode, 0, done.stderr)
        return done.stdout

    def health(self):
        asked = self.ctl("status", "--json")
        status = json.loads(asked.stdout)["status"] if asked.returncode == 0 else {}
        return status.get("health") or {}

    def wait_for_sets(self, more):
        sets = int(self.health().get("sets", 0))
        return until(lambda: int((h := self.health()).get("sets", 0)) >= sets + more and h, f"{more} more sets")

    def wait_for_take(self, state):
        return until(lambda: (t := self.health().get("take")) and t["state"] == f"TAKE_STATE_{state}" and t, f"take is {state}")

    def wait_for_recorded(self, sets):
        until(lambda: (t := self.health().get("take")) and t["state"] == "TAKE_STATE_RECORDING" and int(t["sets"]) >= sets,
              f"{sets} sets in the take")

    def show(self, path):
        shown = self.desk.run("mocapctl", "take", "show", path, "--json")
        self.assertEqual(shown.returncode, 0, shown.stderr)
        verified = self.desk.run("mocapctl", "take", "verify", path)
        self.assertEqual(verified.returncode, 0, verified.stdout + verified.stderr)
        return json.loads(shown.stdout)

    def expect_no_loss(self):
        health = self.wait_for_sets(30)
        self.assertEqual([int(health[key]) for key in ("droppedSnapshots",)], [0])
