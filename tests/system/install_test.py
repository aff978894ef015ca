"""`cmake --install` with a prefix that has a space: programs find their files from any working directory, and unit, .pc file and
documents follow the prefix."""

import os
import pathlib
import shutil
import subprocess
import tempfile
import unittest

from harness import SOURCE

BUILD = pathlib.Path(os.environ["MOCAP_BUILD_DIR"])

CONFIG = """
[capture]
rig = "{prefix}/share/mocapd/demo.rig.toml"

[[subject]]
name = "actor"
marker_set = "{marker_set}"

[[camera]]
name = "cam1"
driver = "synthetic"
marker_set = "markersets/openmocap18.toml"
"""


class Install(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.desk = pathlib.Path(cls.enterClassContext(tempfile.TemporaryDirectory(prefix="mocap install ")))
        cls.prefix = cls.desk / "a prefix/usr"
        ended = subprocess.run(["cmake", "--install", BUILD, "--prefix", cls.prefix], capture_output=True, text=True)
        if ended.returncode != 0:
            raise AssertionError(ended.stdout + ended.stderr)
        cls.elsewhere = cls.desk / "elsewhere"
        cls.elsewhere.mkdir()

    def run_installed(self, program, *arguments):
        return subprocess.run([self.prefix / "bin" / program, *arguments], cwd=self.elsewhere, capture_output=True, text=True)

    def config(self, marker_set):
        path = self.desk / "my.toml"
        path.write_text(CONFIG.format(prefix=self.prefix, marker_set=marker_set))
        return path

    def test_a_configuration_finds_the_shipped_marker_sets(self):
        ended = self.run_installed("mocapd", "--check-config", self.config("markersets/baseline41.toml"))

        self.assertEqual(ended.returncode, 0, ended.stderr)

    def test_a_missing_marker_set_names_both_places(self):
        ended = self.run_installed("mocapd", "--check-config", self.config("markersets/none.toml"))

        self.assertEqual(ended.returncode, 78)
        self.assertIn(f"neither {self.desk}/markersets/none.toml nor {self.prefix}/share/mocapd/markersets/none.toml exists",
                      ended.stderr)

    def test_every_installed_configuration_is_valid(self):
        for path in sorted((self.prefix / "share/mocapd").glob("*.toml")):
            if "rig" not in path.name:
                ended = self.run_installed("mocapd", "--check-config", path)
                self.assertEqual(ended.returncode, 0, ended.stderr)

    def test_the_simulator_finds_its_default_marker_set(self):
        ended = self.run_installed("mocap-sim", "--folders", "images", "--ring", "2", "--size", "64", "48", "--seconds", "0.05")

        self.assertEqual(ended.returncode, 0, ended.stderr)

    def test_no_installed_text_names_the_source_or_the_prefix(self):
        places = [f"{SOURCE}/".encode(), str(self.prefix).encode()]
        for path in (p for p in self.prefix.rglob("*") if p.suffix in {".pc", ".cmake", ".toml", ".md", ".rules", ".conf"}):
            for place in places:
                self.assertNotIn(place, path.read_bytes(), path)

    def test_the_unit_has_the_paths_of_the_prefix(self):
        unit = (self.prefix / "lib/systemd/system/mocapd.service").read_text()

        self.assertIn(f'\nExecStart="{self.prefix}/bin/mocapd" --config /etc/mocapd/mocapd.toml\n', unit)
        bridge = (self.prefix / "lib/systemd/system/mocap-bridge@.service").read_text()
        self.assertIn(f'\nExecStart="{self.prefix}/bin/mocap-%i" $OPTIONS\n', bridge)
        documents = str(self.prefix / "share/doc/mocapd/README.md").replace(" ", "%%20")
        self.assertIn(f"\nDocumentation=file:{documents}\n", unit)
        self.assertTrue((self.prefix / "share/doc/mocapd/README.md").is_file())
        if shutil.which("systemd-analyze"):
            said = subprocess.run(["systemd-analyze", "verify", "--man=no", self.prefix / "lib/systemd/system/mocapd.service"],
                                  capture_output=True, text=True).stderr
            self.assertNotIn("mocapd.service", said)

    def test_the_unit_of_the_prefix_usr_is_the_one_in_the_source(self):
        root = self.desk / "root"
        subprocess.run(["cmake", "--install", BUILD, "--prefix", "/usr"], check=True, capture_output=True,
                       env={**os.environ, "DESTDIR": str(root)})

        self.assertEqual((root / "usr/lib/systemd/system/mocapd.service").read_text(),
                         (SOURCE / "systemd/mocapd.service").read_text())

    def test_a_c_client_builds_with_the_pc_file_of_a_moved_prefix(self):
        moved = self.desk / "moved"
        shutil.copytree(self.prefix, moved, symlinks=True)
        pc = next(moved.rglob("mocap_client.pc"))
        flags = subprocess.run(["pkg-config", "--cflags", "--libs", "mocap_client"], check=True, capture_output=True, text=True,
                               env={**os.environ, "PKG_CONFIG_PATH": str(pc.parent)}).stdout

        subprocess.run(f'cc -o "{self.desk}/example" "{SOURCE}/tools/clients/c/example.c" {flags}', shell=True, check=True)
        ended = subprocess.run([self.desk / "example", "--help"], capture_output=True, text=True,
                               env={**os.environ, "LD_LIBRARY_PATH": str(pc.parent.parent)})

        self.assertEqual(ended.returncode, 64, ended.stderr)  # the example runs, and refuses this endpoint


if __name__ == "__main__":
    unittest.main(verbosity=2)
