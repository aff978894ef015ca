"""The decoders of the messages lite/NAME that are not in C++: the Python client, and the receivers of mocap-relay."""

import importlib.util
import json
import os
import pathlib
import shutil
import subprocess
import sys
import unittest

BUILD = pathlib.Path(os.environ.get("MOCAP_BUILD_DIR", "build/release")).resolve()
ROOT = pathlib.Path(__file__).resolve().parents[2]
RELAY = ROOT / "tools/bridges/relay"
sys.path[:0] = [str(ROOT / "tools/clients/python"), str(BUILD / "python")]

from mocap_client import Phase, decode_lite  # noqa: E402

VECTORS = {path.stem: json.loads(path.read_text()) for path in sorted((ROOT / "proto/lite").glob("*.json"))}


def receiver():
    spec = importlib.util.spec_from_file_location("receive", RELAY / "receive.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


class Lite(unittest.TestCase):
    def compare(self, vector, root, rotations):
        for found, wanted in zip(root, vector["root_m"], strict=True):
            self.assertAlmostEqual(found, wanted, delta=1.1e-4)
        for found, wanted in zip(rotations, vector["sent_rotations_xyzw"], strict=True):
            self.assertEqual(found is None, wanted is None)
            if wanted is not None:
                # 1 - cos(half of 0.0086 degrees) is 3e-9; single precision has 1e-7.
                self.assertGreater(abs(sum(a * b for a, b in zip(found, wanted, strict=True))), 1 - 1e-6)

    def test_the_vectors_exist(self):
        self.assertEqual(set(VECTORS), {"person", "prop", "lost"})

    def test_python_client(self):
        for name, vector in VECTORS.items():
            with self.subTest(name):
                lite = decode_lite(bytes.fromhex(vector["hex"]))

                for field in ("number", "sequence", "description_version", "exposed_at_utc_ns", "subject_bones", "first_bone", "out_of_range",
                              "off_rest"):
                    self.assertEqual(getattr(lite, field), vector[field], field)
                self.assertEqual(lite.phase, Phase(vector["phase"]))
                rotations = [None if lost else list(rotation) for rotation, lost in zip(lite.rotations, lite.lost, strict=True)]
                self.compare(vector, lite.root_position, rotations)

    def test_python_client_converts_axes(self):
        lite = decode_lite(bytes.fromhex(VECTORS["person"]["hex"]), "unreal")

        for found, wanted in zip(lite.root_position, (123.46, 50.0, 98.7), strict=True):
            self.assertAlmostEqual(float(found), wanted, delta=1e-3)
        self.assertEqual(list(lite.rotations[1]), [-1, 0, 0, 0])

    def test_python_client_refuses_what_is_no_message(self):
        good = bytes.fromhex(VECTORS["person"]["hex"])
        for bad in (b"", b"\2" + good[1:], good[:-1], good + b"\0", good[:2] + b"\1" + good[3:], good + good):
            with self.assertRaises(ValueError):
                decode_lite(bad)

    def test_receiver_in_python(self):
        module = receiver()
        for name, vector in VECTORS.items():
            with self.subTest(name):
                lite = module.Lite(bytes.fromhex(vector["hex"]))

                self.assertEqual((lite.number, lite.sequence, lite.exposed_utc_ns),
                                 (vector["number"], vector["sequence"], vector["exposed_at_utc_ns"]))
                self.assertEqual((lite.out_of_range, lite.off_rest), (vector["out_of_range"], vector["off_rest"]))
                self.compare(vector, lite.root, lite.rotations)

    def test_receiver_in_javascript(self):
        if not shutil.which("node"):
            self.skipTest("needs Node.js")
        program = f"""import {{ decodeLite }} from "{RELAY / 'receive.mjs'}";
            const lites = JSON.parse(process.argv[1]).map((hex) => decodeLite(Buffer.from(hex, "hex")));
            console.log(JSON.stringify(lites, (_, value) => (typeof value === "bigint" ? String(value) : value)));"""
        ended = subprocess.run(["node", "--input-type=module", "-e", program, json.dumps([vector["hex"] for vector in VECTORS.values()])],
                               capture_output=True, text=True, check=False, timeout=120)
        self.assertEqual(ended.returncode, 0, ended.stderr)
        for (name, vector), lite in zip(VECTORS.items(), json.loads(ended.stdout), strict=True):
            with self.subTest(name):
                self.assertEqual((int(lite["number"]), lite["sequence"], int(lite["exposedUtcNs"])),
                                 (vector["number"], vector["sequence"], vector["exposed_at_utc_ns"]))
                self.assertEqual((lite["outOfRange"], lite["offRest"]), (vector["out_of_range"], vector["off_rest"]))
                self.compare(vector, lite["root"], lite["rotations"])


if __name__ == "__main__":
    unittest.main(verbosity=2)
