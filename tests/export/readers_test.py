#!/usr/bin/python3
"""Other programs read the exported files: joints within 0.1 mm and 0.01 degree of the clip in every frame, markers within 0.1 mm.

Readers: three.js and Blender (BVH, glTF, FBX), three.js (USD); also Khronos' glTF validator, npm's fbx-parser and
tinyusdz, which check files but do not animate. Markers of C3D, TRC and CSV are read here, by their specifications. A reader that
is not installed is skipped.
"""

import csv
import json
import math
import os
import pathlib
import re
import shutil
import struct
import subprocess
import sys
import tempfile
import unittest

HERE = pathlib.Path(__file__).parent
BIN = pathlib.Path(os.environ.get("MOCAP_BIN_DIR", HERE.parent.parent / "build" / "release" / "bin"))
MODULES = pathlib.Path(os.environ.get("MOCAP_NODE_MODULES", HERE / "npm" / "node_modules"))
HAS_NODE = shutil.which("node") is not None and (MODULES / "three").is_dir()
HAS_BLENDER = shutil.which("blender") is not None
NEEDS_NODE = unittest.skipUnless(HAS_NODE, "node or the packages of tests/export/npm are missing: tools/setup.sh --tests")
NEEDS_BLENDER = unittest.skipUnless(HAS_BLENDER, "blender is missing: apt-get install blender")

LIMIT_M = 1e-4
LIMIT_DEG = 0.01
CM = 0.01


def to_y_up(pose):
    """A pose of the feed (x forward, y left, z up) in the axes of the files: y up, forward z."""
    x, y, z, qx, qy, qz, qw = pose
    return [y, z, x, qy, qz, qx, qw]


def in_m(pose, unit_m):
    return [value * unit_m for value in pose[:3]] + list(pose[3:])


def distance_m(one, other):
    return math.dist(one[:3], other[:3])


def angle_deg(one, other):
    """Of the rotation between two poses. The sine is exact for small angles, unlike the cosine."""
    ax, ay, az, aw = one[3:]
    bx, by, bz, bw = other[3:]
    vector = (aw * bx - ax * bw - ay * bz + az * by, aw * by - ay * bw - az * bx + ax * bz,
              aw * bz - az * bw - ax * by + ay * bx)
    return math.degrees(2.0 * math.asin(min(1.0, math.hypot(*vector))))


def rotated(pose, v):
    """A vector in the frame of a pose, as a point of the world."""
    x, y, z, qx, qy, qz, qw = pose
    t = [2 * (qy * v[2] - qz * v[1]), 2 * (qz * v[0] - qx * v[2]), 2 * (qx * v[1] - qy * v[0])]
    return [x + v[0] + qw * t[0] + qy * t[2] - qz * t[1], y + v[1] + qw * t[1] + qz * t[0] - qx * t[2],
            z + v[2] + qw * t[2] + qx * t[1] - qy * t[0]]


class Readers(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory(prefix="mocap-export-")
        cls.addClassCleanup(folder.cleanup)
        cls.folder = pathlib.Path(folder.name)
        subprocess.run([BIN / "export_samples", cls.folder], check=True)
        cls.truth = json.loads((cls.folder / "truth.json").read_text(encoding="utf-8"))
        cls.subjects = cls.truth["subjects"]
        for subject in cls.subjects:
            subject["frames"] = [[to_y_up(pose) for pose in frame] for frame in subject["frames"]]
        cls.frames = len(cls.subjects[0]["frames"])
        cls.rate = cls.truth["rate"][0] / cls.truth["rate"][1]

    def node(self, script, *arguments):
        ended = subprocess.run(["node", HERE / script, *map(str, arguments)], capture_output=True, text=True,
                               env={**os.environ, "MOCAP_NODE_MODULES": str(MODULES)}, check=False)
        self.assertEqual(ended.returncode, 0, ended.stderr)
        return json.loads(ended.stdout)

    def three(self, name):
        return self.node("read_three.mjs", self.folder / name, self.frames, repr(self.rate))

    def blender(self, name):
        output = self.folder / f"{name}.json"
        ended = subprocess.run(["blender", "-b", "--factory-startup", "--python-exit-code", "1", "--python",
                                HERE / "read_blender.py", "--", self.folder / name, str(self.frames),
                                *map(str, self.truth["rate"]), output],
                               capture_output=True, text=True, check=False)
        self.assertEqual(ended.returncode, 0, ended.stdout + ended.stderr)
        return json.loads(output.read_text(encoding="utf-8"))

    def index_of(self, skeleton, bone):
        """The joint of a bone. Readers add a namespace, drop the colon after it, or add a number."""
        found = [i for i, name in enumerate(skeleton["bones"]) if re.sub(r"_\d+$", "", name).endswith(bone)]
        self.assertEqual(len(found), 1, f"{bone} in {skeleton['bones']}")
        return found[0]

    def compare(self, skeleton, subject, unit_m):
        """The pose of every bone in every frame."""
        worst_m = worst_deg = 0.0
        for b, bone in enumerate(subject["bones"]):
            joint = self.index_of(skeleton, bone)
            for f in range(self.frames):
                expected = subject["frames"][f][b]
                seen = in_m(skeleton["frames"][f][joint], unit_m)
                self.assertLess(distance_m(seen, expected), LIMIT_M, f"{bone} in frame {f}")
                self.assertLess(angle_deg(seen, expected), LIMIT_DEG, f"{bone} in frame {f}")
                worst_m = max(worst_m, distance_m(seen, expected))
                worst_deg = max(worst_deg, angle_deg(seen, expected))
        print(f"{self.id()}: {subject['bones'][0]}: worst {worst_m * 1e3:.5f} mm {worst_deg:.5f} degrees", file=sys.stderr)

    def compare_bind(self, skeleton, subject, unit_m):
        """The bind pose is the T-pose: the differences of joints are the rest offsets."""
        for b, bone in enumerate(subject["bones"]):
            parent = subject["parents"][b]
            if parent < 0:
                continue
            of_parent = skeleton["bind"][self.index_of(skeleton, subject["bones"][parent])]
            of_bone = skeleton["bind"][self.index_of(skeleton, bone)]
            offset = [(of_bone[i] - of_parent[i]) * unit_m for i in range(3)]
            expected = to_y_up([*subject["rest_offsets_m"][b], 0, 0, 0, 1])[:3]
            self.assertLess(math.dist(offset, expected), LIMIT_M, bone)
            self.assertLess(angle_deg([0, 0, 0, 0, 0, 0, 1], of_bone), LIMIT_DEG, bone)

    def compare_all(self, skeletons, unit_m, subjects=None):
        """Each subject with the skeleton whose root is nearest to the subject's in the last frame. `subjects`: default all."""
        subjects = subjects or self.subjects
        self.assertEqual(len(skeletons), len(subjects))
        for subject in subjects:
            root = subject["frames"][-1][0]
            nearest = min(skeletons, key=lambda s: distance_m(in_m(s["frames"][-1][0], unit_m), root))
            self.compare(nearest, subject, unit_m)
            self.compare_bind(nearest, subject, unit_m)

    @NEEDS_NODE
    def test_three_reads_bvh(self):
        for s in (0, 2):  # the head of subject 1 moves relative to its parent, which BVH cannot say
            read = self.three(f"subject{s}.bvh")
            self.assertAlmostEqual(read["duration_s"][0], (self.frames - 1) / self.rate, delta=1e-6)
            self.compare(read["skeletons"][0], self.subjects[s], CM)
            self.compare_ends(read["skeletons"][0], self.subjects[s])

    def compare_ends(self, skeleton, subject):
        """The end of a bone without children is its marker farthest from the joint. three.js lists it after its bone."""
        leaves = [b for b in range(len(subject["bones"])) if b not in subject["parents"]]
        for b in leaves:
            markers = [marker[1:] for marker in subject["markers"] if marker[0] == b]
            end = to_y_up([*max(markers, key=lambda at: math.hypot(*at)), 0, 0, 0, 1])[:3]
            joint = self.index_of(skeleton, subject["bones"][b]) + 1
            self.assertEqual(skeleton["bones"][joint], "ENDSITE")
            for f in range(self.frames):
                seen = in_m(skeleton["frames"][f][joint], CM)[:3]
                self.assertLess(math.dist(seen, rotated(subject["frames"][f][b], end)), LIMIT_M)

    @NEEDS_NODE
    def test_three_reads_gltf(self):
        read = self.three("clip.glb")
        self.assertAlmostEqual(read["duration_s"][0], (self.frames - 1) / self.rate, delta=1e-6)
        self.compare_all(read["skeletons"], 1.0)

    @NEEDS_NODE
    def test_three_reads_fbx(self):
        read = self.three("clip.fbx")
        self.assertAlmostEqual(read["duration_s"][0], (self.frames - 1) / self.rate, delta=1e-6)
        self.compare_all(read["skeletons"], CM)

    @NEEDS_NODE
    def test_three_reads_usd(self):
        read = self.three("clip.usda")
        self.assertAlmostEqual(read["duration_s"][0], (self.frames - 1) / self.rate, delta=1e-6)
        self.compare_all(read["skeletons"], 1.0)

    @NEEDS_NODE
    def test_three_reads_files_of_one_subject(self):
        for suffix, unit_m in {"glb": 1.0, "usda": 1.0, "fbx": CM}.items():
            read = self.three(f"one.{suffix}")["skeletons"]
            self.compare_all(read, unit_m, self.subjects[:1])
            self.assertEqual(read[0]["bones"], self.subjects[0]["bones"])

    @NEEDS_NODE
    def test_tinyusdz_reads_usd(self):
        read = self.node("load_usd.mjs", self.folder / "clip.usda")
        self.assertEqual(read, {"error": "", "meshes": len(self.subjects)})

    @NEEDS_NODE
    def test_the_gltf_validator_finds_no_fault(self):
        report = self.node("validate_gltf.mjs", self.folder / "clip.glb")
        self.assertEqual([], [message for message in report["issues"]["messages"] if message["severity"] <= 1])

    @NEEDS_NODE
    def test_fbx_parser_reads_every_record(self):
        records = {record["name"]: record for record in self.node("parse_fbx.mjs", self.folder / "clip.fbx")}
        objects = {}
        for record in records["Objects"]["nodes"]:
            objects.setdefault(record["name"], []).append(record)
        counted = {kind["props"][0]: kind["nodes"][0]["props"][0]
                   for kind in records["Definitions"]["nodes"] if kind["name"] == "ObjectType"}
        self.assertEqual({**{kind: len(of_kind) for kind, of_kind in objects.items()}, "GlobalSettings": 1}, counted)
        ids = {record["props"][0] for of_kind in objects.values() for record in of_kind} | {"0", 0}
        for connection in records["Connections"]["nodes"]:
            self.assertIn(connection["props"][1], ids)
            self.assertIn(connection["props"][2], ids)
        times = next(node["props"][0] for node in objects["AnimationCurve"][0]["nodes"] if node["name"] == "KeyTime")
        numerator, denominator = self.truth["rate"]
        expected = [(2 * f * 46186158000 * denominator + numerator) // (2 * numerator) for f in range(self.frames)]
        self.assertEqual([int(time) for time in times], expected)

    @NEEDS_BLENDER
    def test_blender_reads_bvh(self):
        for s in (0, 2):
            read = self.blender(f"subject{s}.bvh")
            self.compare(read["skeletons"][0], self.subjects[s], 1.0)

    @NEEDS_BLENDER
    def test_blender_reads_gltf(self):
        self.compare_all(self.blender("clip.glb")["skeletons"], 1.0)

    @NEEDS_BLENDER
    def test_blender_reads_fbx(self):
        read = self.blender("clip.fbx")
        self.assertAlmostEqual(read["rate"], self.rate, delta=1e-4)
        self.compare_all(read["skeletons"], 1.0)

    @NEEDS_BLENDER
    def test_blender_reads_fbx_of_one_subject(self):
        self.compare_all(self.blender("one.fbx")["skeletons"], 1.0, self.subjects[:1])

    # One take with gaps, two persons and a prop, through the command.

    def export(self, name, *options):
        """The path of a file that `mocapctl take export` writes from take.mcap."""
        path = self.folder / f"exported-{name}"
        ended = subprocess.run([BIN / "mocapctl", "take", "export", self.folder / "take.mcap", "--out", path, *options],
                               capture_output=True, text=True, check=False)
        self.assertEqual(ended.returncode, 0, ended.stdout + ended.stderr)
        return path.name

    def compare_markers(self, frames, unit_m, turned=lambda at: at):
        """`frames`: for each frame, the positions of all markers of all subjects; None: lost."""
        self.assertEqual(len(frames), self.frames)
        lost = 0
        for f, seen in enumerate(frames):
            expected = [at for subject in self.subjects for at in subject["marker_frames"][f]]
            self.assertEqual([at is None for at in seen], [at is None for at in expected], f)
            lost += sum(at is None for at in seen)
            for one, other in zip(seen, expected):
                if one is not None:
                    self.assertLess(math.dist([value * unit_m for value in one], turned(other)), LIMIT_M, f)
        self.assertGreater(lost, 0)

    @NEEDS_NODE
    def test_three_reads_an_exported_take(self):
        for name, unit_m in {"take.glb": 1.0, "take.usda": 1.0, "take.fbx": CM}.items():
            self.compare_all(self.three(self.export(name))["skeletons"], unit_m)
        for subject, who in ((0, "Anna"), (2, "Prop")):
            read = self.three(self.export(f"{who}.bvh", "--subject", who))
            self.compare(read["skeletons"][0], self.subjects[subject], CM)

    def test_c3d_of_a_take_by_its_specification(self):
        data = (self.folder / self.export("take.c3d")).read_bytes()
        points, _, first, last = struct.unpack_from("<4H", data, 2)
        scale, start, _, rate = struct.unpack_from("<fHHf", data, 12)
        self.assertEqual(data[1], 0x50)
        self.assertLess(scale, 0.0, "positions are floating-point numbers")
        self.assertAlmostEqual(rate, self.rate, delta=1e-5)
        frames = []
        for f in range(last - first + 1):
            at = (start - 1) * 512 + f * points * 16
            samples = [struct.unpack_from("<4f", data, at + 16 * p) for p in range(points)]
            frames.append([None if sample[3] < 0 else sample[:3] for sample in samples])
        self.compare_markers(frames, 1e-3)

    def test_trc_of_a_take(self):
        lines = (self.folder / self.export("take.trc")).read_text(encoding="utf-8").split("\n")
        header = dict(zip(lines[1].split("\t"), lines[2].split("\t")))
        self.assertEqual(header["Units"], "mm")
        self.assertAlmostEqual(float(header["DataRate"]), self.rate, delta=1e-3)
        frames = []
        for cells in (line.split("\t")[2:] for line in lines[6:] if line):
            self.assertEqual(len(cells), 3 * int(header["NumMarkers"]))
            frames.append([[float(cell) for cell in cells[i:i + 3]] if cells[i] else None for i in range(0, len(cells), 3)])
        self.compare_markers(frames, 1e-3, lambda at: to_y_up([*at, 0, 0, 0, 1])[:3])

    def test_csv_of_a_take(self):
        with open(self.folder / self.export("take.csv"), encoding="utf-8", newline="") as file:
            rows = list(csv.DictReader(file))
        markers = [name[:-len(".x_m")] for name in rows[0] if name.endswith(".x_m") and ":bone:" not in name]
        self.compare_markers([[[float(row[f"{marker}.{axis}_m"]) for axis in "xyz"] if row[f"{marker}.state"] != "lost"
                               else None for marker in markers] for row in rows], 1.0)


if __name__ == "__main__":
    unittest.main()
