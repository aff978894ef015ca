"""Masks: mocap-calibrate learns them from an empty volume and saves them in the rig; the daemon applies them."""

import json
import re
import shutil
import unittest

from harness import GIGE, REPLAY, SOURCE, Desk

CONFIG = """
[capture]
rig = "rig.toml"

[publish]
endpoint = "tcp://127.0.0.1:*"

[record]
snapshots = "{record}"

[[subject]]
name = "actor"
marker_set = "{source}/config/markersets/openmocap18.toml"
"""

LIGHTS = ("--clutter", "8", "--seed", "5")


class Masks(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.desk = Desk()
        cls.addClassCleanup(cls.desk.close)
        rig = SOURCE / "config/demo.rig.toml"
        for folder, more in [("empty", ("--empty", "--seconds", "1")),
                             ("take", ("--motion", "tpose:2,walk", "--seconds", "4")),
                             ("stands", ("--motion", "tpose", "--seconds", "1"))]:
            made = cls.desk.run("mocap-sim", "--folders", folder, "--rig", rig, *LIGHTS, *more)
            assert made.returncode == 0, made.stderr

    def setUp(self):
        shutil.copy(SOURCE / "config/demo.rig.toml", self.rig())

    def rig(self):
        return self.desk.folder / "rig.toml"

    def config(self, folder, more=""):
        text = CONFIG.format(source=SOURCE, record=f"{folder}.jsonl") + more
        text += "".join(REPLAY.format(number=number, folder=folder) for number in range(1, 5))
        return self.desk.write(f"{folder}.toml", text)

    def calibrate(self, folder, *more, config=None, frames=60):
        return self.desk.run("mocap-calibrate", "mask", "--config", config or self.config(folder), "--frames", frames, *more)

    def count_unlabelled(self):
        """Returns the number of unlabelled markers in the last second of the take, when the subject is labelled."""
        (self.desk.folder / "take.jsonl").unlink(missing_ok=True)
        ended = self.desk.run("mocapd", "--config", self.config("take"))
        self.assertEqual(ended.returncode, 0, ended.stderr)
        lines = (self.desk.folder / "take.jsonl").read_text().splitlines()[-60:]
        return sum(len(json.loads(line).get("unlabelled", {}).get("positionsM", [])) // 3 for line in lines)

    def measured_fraction(self):
        """Returns the fraction of measured labels in the last second of the take."""
        lines = (self.desk.folder / "take.jsonl").read_text().splitlines()[-60:]
        states = [state for line in lines for state in json.loads(line)["subjects"][0]["markers"]["states"]]
        return sum(state == "MARKER_STATE_MEASURED" for state in states) / len(states)

    def test_lights_are_masked_and_no_marker_is_lost(self):
        before = self.count_unlabelled()
        learnt = self.calibrate("empty")
        after = self.count_unlabelled()

        self.assertEqual(learnt.returncode, 0, learnt.stderr)
        self.assertRegex(learnt.stdout, r"camera cam1: [1-9]\d* lights, [1-9]\d* polygons, 0\.\d\d % of the image masked")
        self.assertNotIn("moved", learnt.stderr)
        self.assertGreater(before, 60, "without a mask the lights give markers")
        self.assertEqual(after, 0)
        self.assertGreater(self.measured_fraction(), 0.99)

    def test_only_masks_change_in_the_rig_and_clear_removes_them(self):
        original = self.rig().read_text()

        self.assertEqual(self.calibrate("empty", "--dry-run").returncode, 0)
        self.assertEqual(self.rig().read_text(), original)
        self.assertEqual(self.calibrate("empty").returncode, 0)
        masked = self.rig().read_text()
        self.assertEqual(masked.count("mask_learnt"), 4)
        self.assertEqual(re.sub(r"mask_learnt = \[\n(  .*\n)+\]\n", "", masked), original)
        self.assertEqual(self.calibrate("empty").returncode, 0)
        self.assertEqual(self.rig().read_text(), masked, "learning again gives the same masks")
        self.assertEqual(self.calibrate("empty", "--clear").returncode, 0)
        self.assertEqual(self.rig().read_text(), original)

    def test_a_camera_that_the_rig_lacks_is_named_and_the_masks_of_the_others_are_written(self):
        self.rig().write_text(re.sub(r"\[cam4\]\n(?:[^\[\n].*\n)*", "", self.rig().read_text()))
        config = self.config("empty")
        config.write_text(config.read_text().replace("[capture]", "[capture]\nneeds_rig = false"))

        learnt = self.calibrate("empty", config=config)

        self.assertEqual(learnt.returncode, 78, learnt.stderr)
        self.assertIn("has no camera 'cam4': these masks have no place and are not saved", learnt.stderr)
        self.assertIn("written; restart mocapd", learnt.stdout)
        self.assertEqual(self.rig().read_text().count("mask_learnt"), 3)

    def test_a_rig_file_that_cannot_be_written_is_refused_before_cameras_run(self):
        config = self.config("empty")
        config.write_text(config.read_text().replace('rig = "rig.toml"', 'rig = "missing/rig.toml"\nneeds_rig = false'))

        learnt = self.calibrate("empty", config=config)

        self.assertEqual(learnt.returncode, 73, learnt.stderr)
        self.assertRegex(learnt.stderr, r"cannot be written: its folder '.*/missing' does not exist")
        self.assertNotIn("running 4 cameras", learnt.stderr)

    def test_a_walking_person_is_reported_and_not_masked(self):
        learnt = self.calibrate("take", frames=240)

        self.assertEqual(learnt.returncode, 0, learnt.stderr)
        self.assertRegex(learnt.stderr, r"camera cam1: \d+ bright spots moved, or came and went, and are not masked")
        self.assertEqual(self.count_unlabelled(), 0, "only the lights were masked")
        self.assertGreater(self.measured_fraction(), 0.99)

    def test_a_too_large_mask_is_rejected_and_nothing_is_written(self):
        original = self.rig().read_text()

        learnt = self.calibrate("empty", "--most-percent", "0.1")

        self.assertEqual(learnt.returncode, 65, learnt.stderr)
        self.assertRegex(learnt.stderr, r"camera cam\d: 0\.\d % of the image would be masked, expected 0\.1 % at most")
        self.assertEqual(self.rig().read_text(), original)

    def test_a_missing_camera_is_named_and_nothing_is_written(self):
        original = self.rig().read_text()
        text = CONFIG.format(source=SOURCE, record="none.jsonl") + GIGE.format(number=1, address=77)

        learnt = self.calibrate("none", config=self.desk.write("none.toml", text))

        self.assertEqual(learnt.returncode, 69, learnt.stderr)
        self.assertIn("camera 'cam1'", learnt.stderr)
        self.assertEqual(self.rig().read_text(), original)

    def test_masks_are_learnt_from_streaming_gige_cameras(self):
        self.desk.start("mocap-sim", "--serve", "--rig", SOURCE / "config/demo.rig.toml", "--empty", *LIGHTS)
        text = CONFIG.format(source=SOURCE, record="gige.jsonl")
        text += "".join(GIGE.format(number=number, address=number + 1) for number in range(1, 5))

        learnt = self.calibrate("gige", config=self.desk.write("gige.toml", text))

        self.assertEqual(learnt.returncode, 0, learnt.stderr)
        self.assertRegex(learnt.stdout, r"camera cam4: [1-9]\d* lights")
        self.assertEqual(self.rig().read_text().count("mask_learnt"), 4)

    def test_the_log_has_the_threshold_and_the_reason_for_no_blobs(self):
        config = self.config("stands", "[detect]\nmin_area_px2 = 400\n")
        config.write_text(config.read_text().replace("speed = 0", "speed = 0.2"))
        daemon = self.desk.start("mocapd", "--config", config)
        daemon.wait(60)

        self.assertRegex(daemon.output(), r"camera cam1: threshold \d+ grey \(noise [\d.]+, background 1\d\), automatic")
        self.assertRegex(daemon.output(), r"camera cam1: 0 blobs in \d+ images: \d+ too small \(threshold \d+ grey\)")


if __name__ == "__main__":
    unittest.main(verbosity=2)
