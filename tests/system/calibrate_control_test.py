"""The running daemon calibrates its cameras by requests: from no rig to a rig in force, and back to an earlier one."""

import json
import math
import tomllib
import unittest

from calibrate_test import RIG, centres
from harness import GIGE, SOURCE, Desk, free_port, until

CONFIG = """
[capture]
needs_rig = false

[publish]
endpoint = "tcp://127.0.0.1:{feed}"

[control]
endpoint = "tcp://127.0.0.1:{control}"
"""

CAMERAS = 4


def distances(centre):
    """Returns the distance between each two cameras."""
    names = sorted(centre)
    return {(a, b): sum((x - y) ** 2 for x, y in zip(centre[a], centre[b])) ** 0.5 for a in names for b in names if a < b}


class CalibrateByRequests(unittest.TestCase):
    def setUp(self):
        self.desk = Desk()
        self.addCleanup(self.desk.close)
        feed = free_port()
        self.control = feed + 1
        text = CONFIG.format(feed=feed, control=self.control)
        text += "".join(GIGE.format(number=number, address=number + 1) for number in range(1, CAMERAS + 1))
        self.config = self.desk.write("new.toml", text)

    def ctl(self, *arguments):
        return self.desk.run("mocapctl", *arguments, "--endpoint", f"tcp://127.0.0.1:{self.control}")

    def calibration(self):
        asked = self.ctl("calibrate", "status", "--json")
        return json.loads(asked.stdout)["calibration"] if asked.returncode == 0 else {}

    def start(self):
        self.simulated = self.desk.start("mocap-sim", "--serve", "--rig", RIG, "--motion", "wand:0,160,500")
        self.desk.start("mocapd", "--config", self.config, "--state", self.desk.folder / "state")
        until(lambda: self.ctl("status").returncode == 0, "the daemon answers")

    def test_from_no_rig_to_a_rig_in_force_and_back(self):
        self.start()
        self.assertIn("fov_deg", self.ctl("calibrate", "wand").stderr)
        self.assertEqual(self.ctl("calibrate", "apply").returncode, 65)

        made = self.ctl("calibrate", "wand", "--wand", "500", "--fov", "65", "--seconds", "60")

        self.assertEqual(made.returncode, 0, made.stderr)
        self.assertIn("grade", made.stdout)
        rig = self.desk.folder / "state/rig.toml"
        found, truth = distances(centres(rig)), distances(centres(RIG))
        for pair, distance_m in truth.items():
            self.assertAlmostEqual(found[pair], distance_m, delta=0.02, msg=str(pair))
        self.assertLess(tomllib.loads(rig.read_text())["metadata"]["rms_px"], 0.2)
        self.assertEqual(self.calibration()["state"], "CALIBRATION_STATE_APPLIED")
        description = json.loads(self.ctl("description").stdout)
        self.assertTrue(all(camera["fxPx"] > 1 for camera in description["cameras"]))

        self.assertEqual(rig.read_text().count("lens_from_fov = true"), len(centres(RIG)))

        again = self.ctl("calibrate", "wand", "--fov", "65", "--seconds", "30", "--dry-run")
        self.assertEqual(again.returncode, 0, again.stderr)

        self.assertEqual(self.ctl("calibrate", "wand", "--seconds", "30").returncode, 0)
        kept = json.loads(self.ctl("calibrate", "list", "--json").stdout)["rigs"]["rigs"]
        self.assertEqual([each["inForce"] for each in kept], [True, False])
        self.assertEqual(self.ctl("calibrate", "restore", kept[1]["name"]).returncode, 0)
        again = json.loads(self.ctl("calibrate", "list", "--json").stdout)["rigs"]["rigs"]
        self.assertEqual([each["inForce"] for each in again], [False, True])
        self.assertEqual(self.ctl("calibrate", "restore", "nothing").returncode, 65)

    def test_the_floor_frame_gives_the_world(self):
        self.start()
        self.assertIn("is not in the rig", self.ctl("calibrate", "floor").stderr)
        made = self.ctl("calibrate", "wand", "--wand", "500", "--fov", "65", "--seconds", "60")
        self.assertIn("provisional", made.stdout, made.stderr)
        self.simulated.end()
        self.desk.start("mocap-sim", "--serve", "--rig", RIG, "--motion", "frame:600,400")

        def laid():
            self.measured = self.ctl("calibrate", "floor", "--frame", "600,400", "--dry-run")
            return self.measured.returncode == 0

        until(laid, "the cameras are back and see the floor frame")
        rig, good = (self.desk.folder / "state/rig.toml").read_bytes(), self.config.read_text()
        self.config.write_text(good + "\n[nonsense]\n")
        refused = self.ctl("calibrate", "apply")
        self.assertIn("nonsense", refused.stderr)
        self.assertEqual((self.desk.folder / "state/rig.toml").read_bytes(), rig, "a rig that is not in force")
        self.config.write_text(good)
        self.assertEqual(self.ctl("calibrate", "apply").returncode, 0)

        self.assertIn("residual", self.measured.stdout)
        truth, found = centres(RIG), centres(self.desk.folder / "state/rig.toml")
        for name, centre in truth.items():
            self.assertLess(math.dist(centre, found[name]), 0.02, name)
        facts = tomllib.loads((self.desk.folder / "state/rig.toml").read_text())["metadata"]
        self.assertEqual(facts["floor"], "frame")
        self.assertGreater(facts["rms_px"], 0.0)

    def test_a_cancelled_calibration_has_no_result(self):
        self.start()
        self.desk.start("mocapctl", "calibrate", "wand", "--fov", "65", "--endpoint", f"tcp://127.0.0.1:{self.control}")
        until(lambda: self.calibration().get("state") == "CALIBRATION_STATE_COLLECTING", "images are collected")

        self.assertEqual(self.ctl("calibrate", "cancel").returncode, 0)

        self.assertEqual(self.calibration()["state"], "CALIBRATION_STATE_CANCELLED")
        self.assertEqual(self.ctl("calibrate", "apply").returncode, 65)
        self.assertFalse((self.desk.folder / "state/rig.toml").exists())


if __name__ == "__main__":
    unittest.main()
