"""Takes of a running daemon, tracked again and replayed. Runs in its own network namespace."""

import json
import unittest

from harness import SOURCE, Desk, synthetic_volume, until


class Retrack(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.desk = Desk()
        cls.addClassCleanup(cls.desk.close)
        host, port = cls.desk.endpoint.rsplit(":", 1)
        cls.control = f"{host}:{int(port) + 1}"
        config = cls.desk.write("mocapd.toml", synthetic_volume(cls.desk.endpoint) + "\n[takes]\nmin_free_mb = 1\n")
        daemon = cls.desk.start("mocapd", "--config", config)
        until(lambda: cls.tracked(60), "the actor is tracked")
        cls.ctl("take", "start", "first", "--before", "30")  # all since the daemon started
        until(lambda: cls.recorded(120), "120 sets, those from before included")
        cls.ctl("take", "stop")
        cls.ctl("take", "start", "later")
        until(lambda: cls.recorded(300), "300 sets: enough to find the actor again")
        cls.ctl("take", "stop")
        daemon.end()

    @classmethod
    def ctl(cls, *arguments):
        done = cls.desk.run("mocapctl", *arguments, "--endpoint", cls.control)
        assert done.returncode == 0, done.stderr
        return done.stdout

    @classmethod
    def status(cls):
        asked = cls.desk.run("mocapctl", "status", "--json", "--endpoint", cls.control)
        return json.loads(asked.stdout)["status"] if asked.returncode == 0 else {}

    @classmethod
    def tracked(cls, sets):
        status = cls.status()
        phases = [subject.get("phase") for subject in status.get("subjects", [])]
        return phases == ["SUBJECT_PHASE_TRACKING"] and int((status.get("health") or {}).get("sets", 0)) >= sets

    @classmethod
    def recorded(cls, sets):
        take = (cls.status().get("health") or {}).get("take") or {}
        return take.get("state") == "TAKE_STATE_RECORDING" and int(take.get("sets", 0)) >= sets

    def snapshots(self, take):
        shown = self.desk.run("mocap-watch", take, "--json")
        self.assertEqual(shown.returncode, 0, shown.stderr)
        return [json.loads(line) for line in shown.stdout.splitlines()]

    def retrack(self, take, out, *arguments):
        done = self.desk.run("mocapctl", "take", "retrack", take, "--out", out, "--json", *arguments)
        self.assertEqual(done.returncode, 0, done.stderr)
        return json.loads(done.stdout)

    def test_a_take_from_the_start_of_the_run_gives_the_recorded_snapshots(self):
        report = self.retrack("takes/first.mcap", "first-again.mcap")

        self.assertTrue(report["from_start_of_run"], report)
        self.assertGreaterEqual(report["recorded_sets"], 120)
        self.assertEqual(report["equal_sets"], report["recorded_sets"], report)
        self.assertEqual(report["missing_views"], 0)
        before, after = self.snapshots("takes/first.mcap"), self.snapshots("first-again.mcap")
        self.assertEqual(before, after)
        self.assertEqual(before[-1]["subjects"][0]["phase"], "SUBJECT_PHASE_TRACKING")
        verified = self.desk.run("mocapctl", "take", "verify", "first-again.mcap")
        self.assertEqual(verified.returncode, 0, verified.stdout)

    def test_a_take_that_began_while_the_actor_was_tracked_gives_the_recorded_snapshots(self):
        report = self.retrack("takes/later.mcap", "later-same.mcap")

        self.assertFalse(report["from_start_of_run"], report)
        self.assertTrue(report["from_belief"], report)
        self.assertGreaterEqual(report["recorded_sets"], 300)
        self.assertEqual(report["equal_sets"], report["recorded_sets"], report)
        self.assertEqual(report["missing_views"], 0)
        self.assertEqual(self.snapshots("takes/later.mcap"), self.snapshots("later-same.mcap"))
        again = self.retrack("later-same.mcap", "later-third.mcap")
        self.assertEqual(again["equal_sets"], report["recorded_sets"], again)

    def test_a_take_from_later_on_finds_the_actor_by_the_body_in_the_take(self):
        rig = SOURCE / "config/demo.rig.toml"
        report = self.retrack("takes/later.mcap", "later-again.mcap", "--rig", rig)  # the belief is of the recorded rig

        self.assertFalse(report["from_belief"], report)
        before, after = self.snapshots("takes/later.mcap"), self.snapshots("later-again.mcap")
        self.assertEqual([one["number"] for one in before], [one["number"] for one in after])
        self.assertEqual(after[-1]["subjects"][0]["phase"], "SUBJECT_PHASE_TRACKING")

    def test_an_existing_file_is_kept(self):
        self.desk.write("kept.mcap", "mine")
        refused = self.desk.run("mocapctl", "take", "retrack", "takes/first.mcap", "--out", "kept.mcap")

        self.assertEqual(refused.returncode, 65)
        self.assertIn("kept-2.mcap", refused.stderr)
        self.assertEqual((self.desk.folder / "kept.mcap").read_text(), "mine")

    def test_the_daemon_replays_a_take(self):
        config = f"""
[capture]
rig = "{SOURCE}/config/demo.rig.toml"
[publish]
endpoint = "{self.desk.endpoint}"
[record]
snapshots = "replayed.jsonl"
[[subject]]
name = "actor"
marker_set = "{SOURCE}/config/markersets/openmocap18.toml"
""" + "".join(f"""
[[camera]]
name = "cam{number}"
driver = "replay"
file = "takes/first.mcap"
speed = 0
""" for number in range(1, 5))
        ended = self.desk.run("mocapd", "--config", self.desk.write("replay.toml", config))

        self.assertEqual(ended.returncode, 0, ended.stderr)
        lines = (self.desk.folder / "replayed.jsonl").read_text().splitlines()
        self.assertGreaterEqual(len(lines), 120)
        self.assertEqual(json.loads(lines[-1])["subjects"][0]["phase"], "SUBJECT_PHASE_TRACKING")

    def test_a_camera_that_the_take_lacks_is_named(self):
        config = f"""
[capture]
rig = "rig.toml"
[publish]
endpoint = "{self.desk.endpoint}"
[[camera]]
name = "other"
driver = "replay"
file = "takes/first.mcap"
"""
        rig = (SOURCE / "config/demo.rig.toml").read_text().replace("cam1", "other")
        self.desk.write("rig.toml", rig)
        daemon = self.desk.start("mocapd", "--config", self.desk.write("absent.toml", config))
        until(lambda: "has no camera of this name, only cam1, cam2, cam3, cam4" in daemon.output(), "the reason in the log")
        daemon.end()


if __name__ == "__main__":
    unittest.main(verbosity=2)
