"""From cameras without a rig to an exported take in the browser alone, with real programs and simulated GigE cameras."""

import json
import math
import shutil
import subprocess
import unittest

from calibrate_test import RIG, centres
from harness import GIGE_OF_DEMO_RIG, SOURCE, Desk, free_port, synthetic_volume
from web_test import Web, wait_until

CONFIG = """
[capture]
needs_rig = false

[publish]
endpoint = "{feed}"

[takes]
min_free_mb = 1

[[subject]]
name = "actor"
marker_set = "{source}/config/markersets/openmocap18.toml"
"""

CAMERAS = 4
LIBRARY = SOURCE / "tests" / "web" / "npm" / "node_modules" / "playwright-core"
STEP_LIMIT_S = 800


@unittest.skipUnless(shutil.which("node") and LIBRARY.is_dir(), "Node.js or playwright-core is not installed")
@unittest.skipUnless(shutil.which("chromium"), "chromium is not installed")
class InTheBrowser(unittest.TestCase):
    def click_through(self, step):
        done = subprocess.run(["node", SOURCE / "tests/web/live_session.mjs", f"http://127.0.0.1:{self.web.port}", step, self.desk.folder],
                              capture_output=True, text=True, timeout=STEP_LIMIT_S)
        self.assertEqual(done.returncode, 0, done.stderr + self.daemon.output()[-4000:])


class PartsInTheBrowser(InTheBrowser):
    def test_rays_a_drawn_mask_and_a_subject_from_a_c3d_file(self):
        self.desk = Desk()
        self.addCleanup(self.desk.close)
        config = self.desk.write("my.toml", synthetic_volume(self.desk.endpoint).replace("openmocap18", "baseline41"))
        (self.desk.folder / "state").mkdir()
        self.daemon = self.desk.start("mocapd", "--config", config, "--state", self.desk.folder / "state")
        self.web = Web(self.desk, self.desk.endpoint)
        wait_until(lambda: self.web.get("/readyz")[0] == 200, "the daemon's feed")

        self.click_through("rays")
        self.click_through("mask")
        self.assertIn("mask = [", (self.desk.folder / "state/drawn_masks.toml").read_text())
        for action, name in [("ACTION_START", "stand"), ("ACTION_STOP", "")]:
            self.assertEqual(self.web.post("take", {"action": action, "name": name, "seconds": 0})[0], 200)
            if name:
                wait_until(lambda: json.loads(self.web.get("/api/v1/status")[2])["status"].get("health", {}).get("take", {}).get("seconds", 0) > 1.5, "a take of 1.5 s")
        wait_until(lambda: self.web.get("/takes/stand.c3d")[0] == 200, "the exported take")
        (self.desk.folder / "stand.c3d").write_bytes(self.web.get("/takes/stand.c3d")[2])
        self.click_through("import")
        self.assertTrue((self.desk.folder / "state/marker_sets/cara.toml").exists())


class SessionInTheBrowser(InTheBrowser):
    def show(self, motion):
        """The cameras show another scene: the simulator starts anew, and the daemon connects again."""
        if self.scene:
            self.scene.end()
        self.scene = self.desk.start("mocap-sim", "--serve", "--rig", RIG, "--motion", motion)

    def test_from_no_rig_to_an_exported_take(self):
        self.desk = Desk()
        self.addCleanup(self.desk.close)
        self.scene = None
        feed = f"tcp://127.0.0.1:{free_port()}"
        cameras = "".join(GIGE_OF_DEMO_RIG.format(number=number, address=number + 1) for number in range(1, CAMERAS + 1))
        config = self.desk.write("new.toml", CONFIG.format(feed=feed, source=SOURCE) + cameras)
        self.show("wand:0,160,500")
        self.daemon = self.desk.start("mocapd", "--config", config, "--state", self.desk.folder / "state")
        self.web = Web(self.desk, feed)
        wait_until(lambda: self.web.get("/readyz")[0] == 200, "the daemon's feed")

        self.click_through("wand")
        self.show("frame:600,400")
        self.click_through("floor")
        truth, found = centres(RIG), centres(self.desk.folder / "state/rig.toml")
        for name, centre in truth.items():
            self.assertLess(math.dist(centre, found[name]), 0.02, name)
        self.show("tpose:3,walk:60")
        self.click_through("take")

        read = self.desk.run("mocapctl", "take", "verify", self.desk.folder / "walk.mcap")
        self.assertEqual(read.returncode, 0, read.stdout + read.stderr)
        self.assertTrue((self.desk.folder / "walk.c3d").read_bytes().startswith(b"\x02\x50"))


if __name__ == "__main__":
    unittest.main(verbosity=2)
