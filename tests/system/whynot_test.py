"""Why is nobody found? A daemon with one planted cause each: status, watch and doctor name the cause in the same sentence."""

import json
import re
import time
import unittest

from harness import SOURCE, Desk

LIMIT_S = 120
SETS = SOURCE / "config/markersets"
RIG = (SOURCE / "config/demo.rig.toml").read_text()
# A person who stands in T-pose for the whole test.
STANDING = "tpose"


def configuration(desk, own="openmocap18", worn="openmocap18", motion=STANDING, rig=RIG, detect="", cameras=None, label=""):
    """Writes a configuration with four synthetic cameras. `cameras`: additional keys by number."""
    desk.write("rig.toml", rig)
    text = f"""
[capture]
rig = "rig.toml"
[[subject]]
name = "anna"
marker_set = "{SETS}/{own}.toml"
[publish]
endpoint = "{desk.endpoint}"
{detect}
{label}
"""
    for number in range(1, 5):
        text += f"""
[[camera]]
name = "cam{number}"
driver = "synthetic"
rate_hz = 20
motion = "{motion}"
marker_set = "{worn if str(worn).startswith('/') else SETS / (worn + '.toml')}"
{(cameras or {}).get(number, "")}
"""
    return desk.write("mocapd.toml", text)


def numbers_changed(rig, key, change):
    """The rig with the numbers of each line `key = [...]` changed by `change(camera, numbers)`."""
    camera = 0
    lines = []
    for line in rig.splitlines():
        if line.startswith(key + " ="):
            camera += 1
            numbers = [float(number) for number in re.findall(r"-?[0-9.]+(?:e-?[0-9]+)?", line.split("=")[1])]
            line = f"{key} = {json.dumps(change(camera, numbers))}"
        lines.append(line)
    return "\n".join(lines)


class WhyNot(unittest.TestCase):
    def setUp(self):
        self.desk = Desk()
        self.addCleanup(self.desk.close)
        address, _, port = self.desk.endpoint.rpartition(":")
        self.control = f"{address}:{int(port) + 1}"

    def health(self):
        ended = self.desk.run("mocapctl", "status", "--json", "--endpoint", self.control)
        return json.loads(ended.stdout)["status"].get("health", {}) if ended.returncode == 0 else {}

    def status(self):
        return self.desk.run("mocapctl", "status", "--endpoint", self.control).stdout

    def assert_says(self, config, cause, *words):
        """Waits until the daemon reports the cause, then compares the three displays."""
        self.desk.start("mocapd", "--config", config)
        limit = time.monotonic() + LIMIT_S
        found = []
        while time.monotonic() < limit:
            found = [search for search in self.health().get("searches", []) if search["cause"] == "SEARCH_CAUSE_" + cause]
            if found and all(word in found[0]["sentence"] for word in words):
                break
            time.sleep(0.2)
        else:
            self.fail(f"not within {LIMIT_S} s: {cause} {words}; {found} {self.health().get('searches')} {self.status()}")
        self.assertTrue(found[0]["sentence"].startswith("anna is not found: "), found[0])
        self.assert_displayed(words)
        return found[0]

    def assert_displayed(self, words):
        shows = {
            "status": lambda: self.status(),
            "watch": lambda: self.desk.run("mocap-watch", self.desk.endpoint, "--seconds", "4").stdout,
            "doctor": lambda: self.desk.run("mocap-watch", "--doctor", self.desk.endpoint).stderr,
        }
        for name, show in shows.items():
            limit = time.monotonic() + LIMIT_S
            text = show()
            while not ("anna is not found" in text and all(word in text for word in words)):
                self.assertLess(time.monotonic(), limit, f"{name}: {text}")
                text = show()

    def test_threshold_too_high(self):
        config = configuration(self.desk, detect="[detect]\nthreshold = 255\nmin_peak_grey = 0")
        self.assert_says(config, "NO_BLOBS", "no camera sees a marker", "brightest pixel", "threshold 255",
                         "lower the threshold of [detect]")

    def test_lens_caps(self):
        self.images("--brightness", 1, "--noise", 1, "--background", 8)
        found = self.assert_says(self.replayed(RIG), "NO_BLOBS", "no camera sees a marker", "brightest pixel", "lens caps")
        self.assertEqual(found["points"], 0)

    def worn_without(self, name, *dropped):
        """Writes the marker set `name` without some markers."""
        lines = (SETS / f"{name}.toml").read_text().splitlines()
        kept = [line for line in lines if not any(f'name = "{marker}"' in line for marker in dropped)]
        self.assertEqual(len(lines) - len(kept), len(dropped))
        text = re.sub(r'skeleton = "([^"]+)"', lambda found: f'skeleton = "{(SETS / found.group(1)).resolve()}"', "\n".join(kept))
        return self.desk.write("worn.toml", text)

    def test_41_markers_worn_18_configured(self):
        self.assert_says(configuration(self.desk, worn="baseline41"), "WRONG_MARKER_SET",
                         "its set openmocap18 has 18; baseline41 fits")

    def test_18_markers_worn_41_configured(self):
        self.assert_says(configuration(self.desk, own="baseline41"), "WRONG_MARKER_SET",
                         "its set baseline41 has 41; openmocap18 fits")

    def test_two_cameras_covered(self):
        capped = {number: "threshold = 255" for number in (2, 3)}
        config = configuration(self.desk, own="baseline41", worn="baseline41", cameras=capped)
        self.assert_says(config, "FEW_CAMERAS", "only cam1 and cam4 see markers", "cam2", "cam3", "threshold 255")

    def test_not_in_tpose(self):
        found = self.assert_says(configuration(self.desk, motion="crouch"), "NOT_STILL", "stand still in T-pose")
        self.assertGreaterEqual(found["points"], 16)

    def test_partly_outside_the_volume(self):
        # Cameras with a longer lens that see the legs alone.
        legs = numbers_changed(RIG, "matrix", lambda camera, n: [[1100.0, 0.0, 319.5], [0.0, 1100.0, -160.5], [0.0, 0.0, 1.0]])
        config = configuration(self.desk, rig=legs, own="baseline41", worn="baseline41")
        self.assert_says(config, "OUT_OF_VIEW", "move to the middle of the volume")

    def test_a_marker_of_a_person_missing(self):
        worn = self.worn_without("openmocap18", "LeftFoot")
        config = configuration(self.desk, worn=worn, label="[label]\nleast_share = 1.0")
        self.assert_says(config, "MARKERS_MISSING", "1 of 18 markers are missing (probably LeftFoot)")

    def test_a_marker_of_a_prop_missing(self):
        config = configuration(self.desk, own="rigid4", worn=self.worn_without("rigid4", "D"))
        self.assert_says(config, "MARKERS_MISSING", "1 of 4 markers are missing (D)")

    def test_rig_wrong_by_a_metre(self):
        self.images()
        wrong = numbers_changed(RIG, "translation", lambda camera, n: [n[0] + (1.0 if camera % 2 else -1.0), n[1], n[2] + 0.3 * camera])
        self.assert_says(self.replayed(wrong), "RIG_DOES_NOT_FIT", "the rig does not fit the cameras", "mocap-calibrate verify")

    def images(self, *appearance):
        """Renders images of a person in T-pose as seen by the right rig."""
        made = self.desk.run("mocap-sim", "--ring", "4", "--motion", STANDING, "--fps", "10", "--seconds", "5",
                             "--marker-set", SETS / "openmocap18.toml", "--folders", self.desk.folder / "images", *appearance)
        self.assertEqual(made.returncode, 0, made.stderr)

    def replayed(self, rig):
        self.desk.write("rig.toml", rig)
        text = f"""
[capture]
rig = "rig.toml"
[[subject]]
name = "anna"
marker_set = "{SETS}/openmocap18.toml"
[publish]
endpoint = "{self.desk.endpoint}"
"""
        for number in range(1, 5):
            text += f"""
[[camera]]
name = "cam{number}"
driver = "replay"
folder = "{self.desk.folder}/images/cam{number}"
rate_hz = 10
loop = true
"""
        return self.desk.write("mocapd.toml", text)

    def test_nothing_is_said_while_everybody_is_tracked(self):
        self.desk.start("mocapd", "--config", configuration(self.desk, motion="tpose:2,walk"))
        self.desk.watch().wait_for(lambda snapshot: snapshot["subjects"][0].get("phase") == "SUBJECT_PHASE_TRACKING", LIMIT_S, "tracking")
        watched = self.desk.run("mocap-watch", self.desk.endpoint, "--seconds", "20").stdout
        self.assertNotIn("is not found", watched)
        self.assertNotIn("is not found", self.status())
        self.assertEqual(self.desk.run("mocap-watch", "--doctor", self.desk.endpoint).returncode, 0)


if __name__ == "__main__":
    unittest.main(verbosity=2)
