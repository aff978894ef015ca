"""Wand calibration of a rig with all real steps: images, detectors, recordings, mocap-calibrate."""

import math
import shutil
import tomllib
import unittest

from harness import GIGE, REPLAY, SOURCE, Desk

CONFIG = """
[capture]
rig = "rig.toml"

[publish]
endpoint = "tcp://127.0.0.1:*"

[record]
blobs = "{blobs}"

[[subject]]
name = "actor"
marker_set = "{source}/config/markersets/openmocap18.toml"
"""

RIG = SOURCE / "config/demo.rig.toml"


def centres(path):
    """Returns the camera centres of a rig file, -R^T t, by name."""
    found = {}
    for name, camera in tomllib.loads(path.read_text()).items():
        if name == "metadata":
            continue
        r, t = camera["rotation"], camera["translation"]
        angle = math.sqrt(sum(x * x for x in r)) or 1e-30
        k = [-x / angle for x in r]
        cross = [k[1] * t[2] - k[2] * t[1], k[2] * t[0] - k[0] * t[2], k[0] * t[1] - k[1] * t[0]]
        dot = sum(a * b for a, b in zip(k, t))
        found[camera["name"]] = [
            -(t[i] * math.cos(angle) + cross[i] * math.sin(angle) + k[i] * dot * (1 - math.cos(angle))) for i in range(3)
        ]
    return found


class Calibrate(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.desk = Desk()
        cls.addClassCleanup(cls.desk.close)
        made = cls.desk.run("mocap-sim", "--folders", "wave", "--rig", RIG, "--motion", "wand:0,160,500", "--fps", "12",
                            "--seconds", "15", "--clutter", "1")
        assert made.returncode == 0, made.stderr
        shutil.copy(RIG, cls.desk.folder / "rig.toml")

    def config(self, name, cameras, blobs=""):
        return self.desk.write(name, CONFIG.format(source=SOURCE, blobs=blobs) + "".join(cameras))

    def replay(self):
        return [REPLAY.format(number=number, folder="wave") for number in range(1, 5)]

    def expect_true_distances(self, rig, most_m):
        """Expects the true distances between the cameras. Distances do not depend on the world frame of the rig."""
        truth, found = centres(RIG), centres(self.desk.folder / rig)
        self.assertEqual(truth.keys(), found.keys())
        for a in truth:
            for b in truth:
                self.assertAlmostEqual(math.dist(truth[a], truth[b]), math.dist(found[a], found[b]), delta=most_m)

    def test_recorded_images_give_the_true_rig(self):
        config = self.config("replay.toml", self.replay())

        solved = self.desk.run("mocap-calibrate", "wand", "--config", config, "--out", "solved.toml", "--record", "take.blobs")
        again = self.desk.run("mocap-calibrate", "wand", "--blobs", "take.blobs", "--rig", RIG, "--out", "again.toml")

        self.assertEqual(solved.returncode, 0, solved.stderr)
        self.expect_true_distances("solved.toml", 0.004)
        self.assertIn("floor: where it was", solved.stdout)
        self.assertEqual(again.returncode, 0, again.stderr)
        self.expect_true_distances("again.toml", 0.004)

    def test_a_recording_that_cannot_be_written_costs_no_rig(self):
        config = self.config("full.toml", self.replay())
        (self.desk.folder / "full.blobs").symlink_to("/dev/full")

        solved = self.desk.run("mocap-calibrate", "wand", "--config", config, "--out", "full.rig.toml", "--record", "full.blobs")

        self.assertEqual(solved.returncode, 73, solved.stderr)
        self.assertIn("the recording is incomplete, and all blobs are used", solved.stderr)
        self.expect_true_distances("full.rig.toml", 0.004)

    def test_no_lens_file_is_needed(self):
        config = self.config("nolens.toml", self.replay())

        solved = self.desk.run("mocap-calibrate", "wand", "--config", config, "--fov", "60", "--refine-lens",
                               "--out", "nolens.rig.toml")

        self.assertEqual(solved.returncode, 0, solved.stderr)
        self.expect_true_distances("nolens.rig.toml", 0.06)

    def test_a_recording_of_the_daemon_gives_the_rig(self):
        config = self.config("daemon.toml", self.replay(), blobs="daemon.blobs")
        daemon = self.desk.start("mocapd", "--config", config)
        daemon.wait(120)

        solved = self.desk.run("mocap-calibrate", "wand", "--blobs", "daemon.blobs", "--rig", RIG, "--out", "daemon.rig.toml")

        self.assertEqual(solved.returncode, 0, solved.stderr + daemon.output())
        self.expect_true_distances("daemon.rig.toml", 0.004)

    def test_a_wrong_wand_length_is_rejected_and_nothing_is_written(self):
        config = self.config("wrong.toml", self.replay())

        solved = self.desk.run("mocap-calibrate", "wand", "--config", config, "--wand", "0,128,400", "--out", "wrong.rig.toml")

        self.assertEqual(solved.returncode, 65, solved.stderr)
        self.assertIn("the wand is 500 mm long, expected 400", solved.stderr)
        self.assertFalse((self.desk.folder / "wrong.rig.toml").exists())

    def test_streaming_gige_cameras_are_calibrated_and_aligned_with_the_floor(self):
        config = self.config("gige.toml", [GIGE.format(number=number, address=number + 1) for number in range(1, 5)])
        served = self.desk.start("mocap-sim", "--serve", "--rig", RIG, "--motion", "wand", "--fps", "30")
        solved = self.desk.run("mocap-calibrate", "wand", "--config", config, "--moved", "--seconds", "20", "--out", "gige.rig.toml")
        served.end()
        self.assertEqual(solved.returncode, 0, solved.stderr)
        self.expect_true_distances("gige.rig.toml", 0.004)

        self.desk.start("mocap-sim", "--serve", "--rig", RIG, "--motion", "frame:600,400", "--fps", "30")
        laid = self.desk.run("mocap-calibrate", "floor", "--config", config, "--rig", "gige.rig.toml", "--seconds", "3")

        self.assertEqual(laid.returncode, 0, laid.stderr)
        truth, found = centres(RIG), centres(self.desk.folder / "gige.rig.toml")
        for name in truth:
            self.assertLess(math.dist(truth[name], found[name]), 0.02, name)


if __name__ == "__main__":
    unittest.main(verbosity=2)
