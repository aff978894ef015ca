"""Output and exit codes of the mocapd command line."""

import os
import re
import unittest

from harness import SOURCE, Desk

GOOD = """
[capture]
rig = "{source}/config/demo.rig.toml"

[[subject]]
name = "actor"
marker_set = "{source}/config/markersets/openmocap18.toml"

[publish]
endpoint = "tcp://127.0.0.1:*"

[[camera]]
name = "cam1"
driver = "synthetic"
marker_set = "{source}/config/markersets/openmocap18.toml"
"""


class Commands(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.desk = Desk()
        cls.addClassCleanup(cls.desk.close)

    def ended(self, *arguments):
        return self.desk.run("mocapd", *arguments)

    def config(self, more="", name="my.toml"):
        return self.desk.write(name, GOOD.format(source=SOURCE) + more)

    def faults(self, path):
        ended = self.ended("--check-config", path)
        self.assertEqual(ended.returncode, 78, ended.stderr)
        self.assertEqual(ended.stdout, "")
        return ended.stderr

    def test_every_shipped_configuration_is_valid(self):
        for path in sorted((SOURCE / "config").glob("*.toml")):
            if "rig" in path.name:
                continue
            ended = self.ended("--check-config", path)
            self.assertEqual(ended.returncode, 0, ended.stderr)
            self.assertIn("good", ended.stdout)

    def test_a_wrong_command_line_ends_with_64_and_points_to_the_help(self):
        for arguments in [(), ("--confg", "x"), ("x",), ("--config",), ("--config", "a", "--check-config", "b")]:
            ended = self.ended(*arguments)
            self.assertEqual(ended.returncode, 64, arguments)
            self.assertIn("--help", ended.stderr)

    def test_help_and_version_are_no_failures(self):
        self.assertIn("examples:", self.ended("--help").stdout)
        self.assertRegex(self.ended("--version").stdout, r"^mocapd \d+\.\d+\.\d+\n$")

    def test_an_unreadable_file_gives_one_line(self):
        (self.desk.folder / "folder.toml").mkdir(exist_ok=True)
        junk = self.desk.folder / "junk.toml"
        junk.write_bytes(bytes(range(256)) * 16)

        self.assertIn("no such file", self.faults("nothere.toml"))
        self.assertIn("is a folder", self.faults("folder.toml"))
        self.assertIn("junk.toml:1:", self.faults(junk))
        self.assertIn("expected at least one", self.faults(self.desk.write("empty.toml", "")))

    def test_all_faults_are_listed_with_their_places(self):
        faults = self.faults(self.config('[detect]\ntreshold = 1\n[log]\nlevel = "loud"\n'))

        self.assertRegex(faults, r"my\.toml:\d+:1: detect: unknown key 'treshold', did you mean 'threshold'\?")
        self.assertRegex(faults, r"my\.toml:\d+:9: log: level is 'loud', expected one of")
        self.assertIn("2 faults", faults)

    def test_a_marker_set_that_does_not_distinguish_front_from_back_gives_a_warning(self):
        limbs = "ShoulderTop|UArmHigh|ElbowOut|WristOut|Thigh|KneeOut|Shin|AnkleOut"
        kept = rf"(?!asym)(name = |skeleton = |marker = |\]$|.*(Head|Back)Top|.*({limbs}))"
        text = (SOURCE / "config/markersets/baseline41.toml").read_text().replace("../", f"{SOURCE}/config/")
        for right, as_left in (("-0.250]", "-0.190]"), ("-0.220]", "-0.160]"), ("-0.150, 0.060]", "-0.110, 0.060]")):
            text = text.replace(right, as_left)
        sparse = self.desk.write("sparse.toml", "\n".join(line for line in text.splitlines() if re.match(kept, line)))
        worn = self.config().read_text().replace(f"{SOURCE}/config/markersets/openmocap18.toml", str(sparse), 1)

        ended = self.ended("--check-config", self.desk.write("worn.toml", worn))

        self.assertEqual(ended.returncode, 0, ended.stderr)
        self.assertRegex(ended.stderr, r"worn\.toml: warning: front and back of subject 'actor' .*LThigh.* in .*sparse")

    def test_faults_that_only_the_driver_detects_are_listed_before_the_start(self):
        path = self.config('motion = "dance:2"\n')

        self.assertIn("camera 'cam1': motion: 'dance:2'", self.faults(path))
        self.assertEqual(self.ended("--config", path).returncode, 78)

    def test_a_missing_folder_ends_with_69(self):
        ended = self.ended("--config", self.config('[record]\nsnapshots = "/nothere/take.pb"\n'))

        self.assertEqual(ended.returncode, 69, ended.stderr)
        self.assertIn("'/nothere/take.pb'", ended.stderr)

    def test_an_unreadable_configuration_is_a_fault(self):
        if os.geteuid() == 0:
            self.skipTest("root reads everything")
        path = self.config(name="secret.toml")
        path.chmod(0)
        self.assertIn("Permission denied", self.faults(path))

    def test_the_settings_in_force_are_logged_at_debug_level(self):
        ended = self.ended("--config", self.config('speed = 0\n[log]\nlevel = "debug"\n[record]\nsnapshots = "/nothere/x.pb"\n'))

        self.assertRegex(ended.stderr, r"debug settings: align\.window_us = 500\n")
        self.assertRegex(ended.stderr, r"debug settings: camera\.cam1\.rate_hz = 60\n")


if __name__ == "__main__":
    unittest.main(verbosity=2)
