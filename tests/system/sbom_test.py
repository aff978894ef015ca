"""The bill of materials of a package: valid SPDX 2.3, with the package's real dependencies in the versions of this machine."""

import json
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest

import sbom

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
CONTROL = """Package: {name}
Version: 1.2+b1-3
Architecture: {architecture}
Maintainer: A B <a@example.org>
Depends: {depends}
Description: for a test
 of bills of materials
"""


def has_dpkg():
    try:
        return subprocess.run(["dpkg-deb", "--version"], capture_output=True, check=False).returncode == 0
    except FileNotFoundError:
        return False


@unittest.skipUnless(has_dpkg(), "dpkg is not installed")
class Sbom(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def package(self, name, architecture, depends):
        content = self.folder / name
        (content / "DEBIAN").mkdir(parents=True)
        (content / "DEBIAN/control").write_text(CONTROL.format(name=name, architecture=architecture, depends=depends))
        deb = self.folder / f"{name}.deb"
        subprocess.run(["dpkg-deb", "--root-owner-group", "-Znone", "--build", content, deb], check=True, capture_output=True)
        return deb

    def write(self, *debs):
        environment = os.environ | {"SOURCE_DATE_EPOCH": "1700000000"}
        done = subprocess.run([sys.executable, ROOT / "tools/debian/sbom.py", *debs], capture_output=True, text=True, check=False,
                              env=environment)
        self.assertEqual(done.returncode, 0, done.stderr)
        return [json.loads(deb.with_suffix(".spdx.json").read_text()) for deb in debs]

    def test_lists_dependencies_in_the_versions_of_this_machine(self):
        first = self.package("a1", "amd64", "dpkg (>= 1), no-such-package | libc6 (>= 2.3), b1 (= 1.2+b1-3)")
        second = self.package("b1", "all", "libc6")

        documents = self.write(first, second)

        self.assertEqual(sbom.faults_of_package(first), [])
        self.assertEqual(sbom.faults_of_package(second), [])
        versions = {each["name"]: each.get("versionInfo") for each in documents[0]["packages"]}
        here = subprocess.run(["dpkg-query", "--show", "--showformat=${Version}", "dpkg"], capture_output=True, text=True, check=True)
        self.assertEqual(versions["dpkg"], here.stdout)
        self.assertEqual(versions["b1"], "1.2+b1-3")
        self.assertNotIn("no-such-package", versions)
        self.assertIn("libeigen3-dev", versions, "a library of headers is part of the program")
        self.assertNotIn("libeigen3-dev", [each["name"] for each in documents[1]["packages"]])

    def test_lists_the_provider_of_a_virtual_package(self):
        deb = self.package("a1", "amd64", "awk")  # every Debian has one

        (document,) = self.write(deb)

        self.assertEqual(sbom.faults_of_package(deb), [])
        names = [each["name"] for each in document["packages"]]
        self.assertTrue({"mawk", "gawk", "original-awk"} & set(names), names)
        self.assertNotIn("awk", names)

    def test_is_the_same_for_the_same_package(self):
        deb = self.package("a1", "amd64", "libc6")

        self.assertEqual(self.write(deb), self.write(deb))

    def test_the_check_sees_faults(self):
        deb = self.package("a1", "amd64", "dpkg, libc6")
        path = deb.with_suffix(".spdx.json")
        [whole] = self.write(deb)

        def faults(change):
            document = json.loads(json.dumps(whole))
            change(document)
            path.write_text(json.dumps(document))
            return " ".join(sbom.faults_of_package(deb))

        self.assertIn("no creationInfo", faults(lambda each: each.pop("creationInfo")))
        self.assertIn("time of creation", faults(lambda each: each["creationInfo"].update(created="today")))
        self.assertIn("malformed SPDXID", faults(lambda each: each["packages"][1].update(SPDXID="dpkg")))
        self.assertIn("not listed", faults(lambda each: each["relationships"].pop(1)))
        self.assertIn("checksum", faults(lambda each: each["packages"][0]["checksums"][0].update(checksumValue="0")))
        self.assertIn("has no version", faults(lambda each: each["packages"][1].pop("versionInfo")))

    def test_refuses_what_is_no_package(self):
        (self.folder / "a.deb").write_text("nothing")

        done = subprocess.run([sys.executable, ROOT / "tools/debian/sbom.py", self.folder / "a.deb"], capture_output=True, text=True,
                              check=False)

        self.assertEqual(done.returncode, 66)
        self.assertIn("a.deb", done.stderr)


if __name__ == "__main__":
    unittest.main()
