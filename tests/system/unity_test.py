"""The Unity package: what Unity's package manager demands, and its components with stand-ins for Unity and a real feed."""

import hashlib
import json
import os
import pathlib
import re
import shutil
import subprocess
import unittest

from fake_feed import STANDING, FakeFeed
from harness import BIN, SOURCE, Desk

LIBRARY = BIN.parent / "lib/libmocap_client.so"
UNITY = SOURCE / "tools/clients/unity"
STAND_INS = SOURCE / "tests/clients/unity"
CASES = [json.loads(path.read_text()) for path in sorted((SOURCE / "proto/axes").glob("*.json"))]
TOLERANCE = 1e-5  # single precision; positions are multiples of a power of two

# Projects of users refer to the components by these GUIDs, so they may never change.
PUBLISHED = {
    "Runtime/MocapFeed.cs": "a8fb2cdf56d157a6a2a3fe96c691793d",
    "Runtime/MocapHumanoid.cs": "11b398fd1e1bce986800f1e1f34ca58a",
    "Runtime/MocapProp.cs": "914450e65cc8253f7dc7eb275a9df9e0",
    "Runtime/MocapMarkers.cs": "994b6310922abc0fa42f5a8e97048c62",
}
BUILT_IN = {"0000000000000000e000000000000000", "0000000000000000f000000000000000"}  # Unity's own meshes and materials


def pack(*arguments):
    return subprocess.run([UNITY / "pack.sh", *arguments], capture_output=True, text=True)


def is_hidden(name):
    """Unity ignores these files and folders."""
    return name.startswith(".") or name.endswith("~")


def guid_of(meta):
    """The GUID in a .meta file; fails if there is not exactly one with 32 hexadecimal digits."""
    found = re.findall(r"^guid: (.*)$", meta.read_text(), re.MULTILINE)
    assert len(found) == 1 and re.fullmatch("[0-9a-f]{32}", found[0]), f"{meta}: {found}"
    return found[0]


class Package(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.desk = Desk()
        cls.addClassCleanup(cls.desk.close)
        windows = cls.desk.folder / "windows"
        windows.mkdir()
        for name in ("mocap_client.dll", "libzmq.dll", "README.txt"):
            (windows / name).write_bytes(b"MZ")
        made = pack(cls.desk.folder, "--windows", windows, LIBRARY)
        assert made.returncode == 0, made.stderr
        cls.tarball = pathlib.Path(made.stdout.strip())
        subprocess.run(["tar", "-xzf", cls.tarball, "-C", cls.desk.folder], check=True)
        cls.root = cls.desk.folder / "package"
        cls.manifest = json.loads((cls.root / "package.json").read_text())

    def entries(self):
        """Files and folders that must have a .meta file: not hidden, and not in a hidden folder except a sample."""
        for path in sorted(self.root.rglob("*")):
            if path.suffix != ".meta" and not is_hidden(path.name):
                yield path

    def test_the_manifest_has_what_the_package_manager_requires(self):
        self.assertRegex(self.manifest["name"], r"^[a-z0-9-]+(\.[a-z0-9-]+){2,}$")
        self.assertLessEqual(len(self.manifest["name"]), 50)
        self.assertRegex(self.manifest["version"], r"^(0|[1-9]\d*)\.(0|[1-9]\d*)\.(0|[1-9]\d*)(-[0-9A-Za-z.-]+)?$")
        self.assertRegex(self.manifest["unity"], r"^20(2[1-9]|[3-9]\d)\.[1-9]$")
        for field in ("displayName", "description", "license"):
            self.assertGreater(len(self.manifest[field]), 3, field)
        # Animator and Collider are in modules that a project may switch off.
        self.assertEqual(set(self.manifest["dependencies"]), {"com.unity.modules.animation", "com.unity.modules.physics"})
        self.assertEqual(self.tarball.name, f"{self.manifest['name']}-{self.manifest['version']}.tgz")
        self.assertIn("## " + self.manifest["version"], (self.root / "CHANGELOG.md").read_text())
        readme = (self.root / "README.md").read_text()
        self.assertIn(self.tarball.name, readme)
        self.assertIn(f"Assets/Samples/{self.manifest['displayName']}/{self.manifest['version']}/", readme)
        for name in ("README.md", "LICENSE.md", "Third Party Notices.md"):
            self.assertGreater((self.root / name).stat().st_size, 100, name)

    def test_every_sample_exists_in_a_hidden_folder(self):
        self.assertTrue(self.manifest["samples"])
        for sample in self.manifest["samples"]:
            self.assertTrue(sample["displayName"] and sample["description"])
            self.assertTrue(sample["path"].startswith("Samples~/"), sample)
            self.assertTrue(list((self.root / sample["path"]).glob("*.unity")), sample)

    def test_every_file_and_folder_has_a_meta_file_of_its_own_guid(self):
        guids = {}
        for path in self.entries():
            meta = path.with_name(path.name + ".meta")
            self.assertTrue(meta.is_file(), f"{path} has no .meta file")
            self.assertNotIn(guid_of(meta), guids, path)
            guids[guid_of(meta)] = path
            self.assertEqual("folderAsset: yes" in meta.read_text(), path.is_dir(), path)
            self.assertTrue(meta.read_text().startswith("fileFormatVersion: 2\n"), path)
        for meta in self.root.rglob("*.meta"):
            self.assertTrue(meta.with_suffix("").exists(), f"{meta} is left over")
        self.assertFalse((self.root / "Samples~.meta").exists())
        self.assertGreater(len(guids), 25)

    def test_the_guids_of_the_components_never_change(self):
        found = {name: guid_of(self.root / (name + ".meta")) for name in PUBLISHED}
        self.assertEqual(found, PUBLISHED)

    def test_the_same_input_gives_the_same_tarball(self):
        again = self.desk.folder / "again"
        again.mkdir()
        made = pack(again, "--windows", self.desk.folder / "windows", LIBRARY)
        digests = {hashlib.sha256(pathlib.Path(path).read_bytes()).hexdigest() for path in (self.tarball, made.stdout.strip())}
        self.assertEqual(len(digests), 1)

    def platforms_of(self, library):
        """Platform of a native library -> (enabled, settings)."""
        text = (self.root / "Runtime/Plugins/x86_64" / (library + ".meta")).read_text()
        self.assertIn("PluginImporter:", text)
        blocks = re.findall(r"  - first:\n      (.*?): (.*)\n    second:\n      enabled: ([01])\n      settings:(.*\n(?:        .*\n)*)", text)
        return {name or kind: (enabled == "1", dict(re.findall(r"        (.*): (.*)", settings))) for kind, name, enabled, settings in blocks}

    def test_each_native_library_is_loaded_on_its_own_platform_only(self):
        for library, system, own in (("libmocap_client.so", "Linux", "Linux64"), ("mocap_client.dll", "Windows", "Win64"),
                                     ("libzmq.dll", "Windows", "Win64")):
            platforms = self.platforms_of(library)
            self.assertEqual(platforms["Editor"], (True, {"CPU": "x86_64", "DefaultValueInitialized": "true", "OS": system}))
            self.assertEqual({name for name, (enabled, _) in platforms.items() if enabled}, {"Editor", own}, library)
            self.assertEqual(platforms[own][1], {"CPU": "x86_64"})
        native = self.root / "Runtime/Plugins/x86_64"
        self.assertEqual({path.name for path in native.iterdir() if path.suffix != ".meta"},
                         {"libmocap_client.so", "mocap_client.dll", "libzmq.dll"})
        self.assertEqual((native / "libmocap_client.so").read_bytes(), LIBRARY.read_bytes())

    def assemblies(self):
        """Name -> (asmdef, its folder), for each assembly of the package."""
        found = {}
        for path in self.root.rglob("*.asmdef"):
            asmdef = json.loads(path.read_text())
            self.assertNotIn(asmdef["name"], found)
            self.assertEqual(path.stem, asmdef["name"])
            found[asmdef["name"]] = (asmdef, path.parent)
        return found

    def test_references_of_assemblies_resolve_and_every_script_belongs_to_one(self):
        assemblies = self.assemblies()
        for asmdef, folder in assemblies.values():
            self.assertLessEqual(set(asmdef["references"]), set(assemblies), folder)
            self.assertEqual(asmdef["includePlatforms"], ["Editor"] if folder.name == "Editor" else [])
        folders = [folder for _, folder in assemblies.values()]
        for script in self.root.rglob("*.cs"):
            self.assertEqual(sum(folder in script.parents for folder in folders), 1, script)

    def test_a_component_is_in_the_file_of_its_name(self):
        for script in self.root.rglob("*.cs"):
            for name in re.findall(r"class (\w+) : (?:MonoBehaviour|MocapReceiver)\b", script.read_text()):
                self.assertEqual(name, script.stem)

    def test_the_scene_is_complete_and_refers_to_scripts_of_the_package(self):
        scripts = {guid_of(meta): meta.with_suffix("") for meta in self.root.rglob("*.cs.meta")}
        for scene in self.root.rglob("*.unity"):
            text = scene.read_text()
            self.assertTrue(text.startswith("%YAML 1.1\n%TAG !u! tag:unity3d.com,2011:\n"))
            objects = {fid: body for fid, body in re.findall(r"^--- !u!\d+ &(\d+)\n((?:(?!---).*\n)+)", text, re.MULTILINE)}
            self.assertEqual(len(objects), text.count("--- !u!"), "an id occurs twice")
            for fid, body in objects.items():
                for owner in re.findall(r"m_GameObject: {fileID: (\d+)}", body):
                    self.assertIn(f"component: {{fileID: {fid}}}", objects[owner], "the object does not list its component")
                for local in re.findall(r"{fileID: (\d+)}", body):
                    self.assertIn(local, {"0", *objects}, f"{scene}: object {fid}")
            used = {scripts[guid].stem for guid in re.findall(r"guid: ([0-9a-f]+)", text) if guid not in BUILT_IN}
            self.assertLessEqual({"MocapFeed", "MocapProp", "MocapMarkers"}, used)
            for guid, body in re.findall(r"m_Script: {fileID: 11500000, guid: ([0-9a-f]{32}), type: 3}\n((?:  .*\n)*)", text):
                script = scripts[guid].read_text() + (self.root / "Runtime/MocapReceiver.cs").read_text()
                for field in re.findall(r"^  ([a-z]\w*):", body, re.MULTILINE):
                    if not field.startswith("m_"):
                        self.assertRegex(script, rf"public \w+ {field}\b", f"{scripts[guid].name} has no field {field}")

    def test_pack_refuses_wrong_arguments_with_a_reason(self):
        for arguments, code, reason in (((), 64, "usage"), ((self.desk.folder,), 64, "no native library"),
                                        (("/nowhere", LIBRARY), 66, "not a folder"),
                                        ((self.desk.folder, "/nowhere.so"), 66, "mocap_client first"),
                                        ((self.desk.folder, "--windows", self.desk.folder), 66, "no mocap_client.dll"),
                                        ((self.desk.folder, "--mac"), 64, "unknown option")):
            made = pack(*arguments)
            self.assertEqual(made.returncode, code, arguments)
            self.assertIn(reason, made.stderr)

    def test_meta_refuses_a_file_of_unknown_kind(self):
        folder = self.desk.folder / "other"
        folder.mkdir()
        for name in ("package.json", "a.xyz"):
            (folder / name).write_text("{}")
        made = subprocess.run([UNITY / "meta.py", folder], capture_output=True, text=True)
        self.assertEqual(made.returncode, 65)
        self.assertIn("a.xyz", made.stderr)


@unittest.skipUnless(shutil.which("mcs") and shutil.which("mono"), "mono-mcs is not installed")
class Components(unittest.TestCase):
    """The scripts of the packed package, compiled assembly by assembly, with the packed native library."""

    @classmethod
    def setUpClass(cls):
        cls.desk = Desk()
        cls.addClassCleanup(cls.desk.close)
        made = pack(cls.desk.folder, LIBRARY)
        assert made.returncode == 0, made.stderr
        subprocess.run(["tar", "-xzf", made.stdout.strip(), "-C", cls.desk.folder], check=True)
        cls.root = cls.desk.folder / "package"
        cls.out = cls.desk.folder / "bin"
        cls.out.mkdir()
        cls.compile("library", "UnityEngine.dll", [], [STAND_INS / "UnityEngine.cs"], "-nowarn:649")
        cls.compile("library", "UnityEditor.dll", ["UnityEngine.dll"], [STAND_INS / "UnityEditor.cs"])
        for path in sorted(cls.root.rglob("*.asmdef"), key=lambda path: len(json.loads(path.read_text())["references"])):
            asmdef = json.loads(path.read_text())
            engine = ["UnityEngine.dll", *(["UnityEditor.dll"] if asmdef["includePlatforms"] == ["Editor"] else [])]
            references = engine + [name + ".dll" for name in asmdef["references"]]
            cls.compile("library", asmdef["name"] + ".dll", references, sorted(path.parent.rglob("*.cs")))
        references = ["UnityEngine.dll", "Mocapd.dll", "Mocapd.Samples.Live.dll"]
        for program in ("Scene", "Characters"):
            cls.compile("exe", program + ".exe", references, [STAND_INS / (program + ".cs")])

    @classmethod
    def compile(cls, target, name, references, sources, *more):
        ended = subprocess.run(["mcs", "-nologo", "-langversion:5", "-warnaserror", *more, f"-target:{target}", f"-out:{cls.out / name}",
                                *(f"-r:{cls.out / each}" for each in references), *sources], capture_output=True, text=True)
        assert ended.returncode == 0, f"{name}: {ended.stdout}{ended.stderr}"

    def run_program(self, *arguments):
        environment = {**os.environ, "LD_LIBRARY_PATH": str(self.root / "Runtime/Plugins/x86_64")}
        ended = subprocess.run(["mono", *arguments], cwd=self.out, capture_output=True, text=True, timeout=120, env=environment)
        self.assertEqual(ended.returncode, 0, ended.stdout + ended.stderr)
        return ended.stdout

    def show(self, turned=False, subjects=1, **feed):
        fake = FakeFeed(**feed)
        self.addCleanup(fake.close)
        return json.loads(self.run_program("Scene.exe", fake.endpoint, str(int(turned)), str(subjects)))

    def assert_near(self, found, expected, what):
        for one, other in zip(found, expected, strict=True):
            self.assertAlmostEqual(one, other, delta=TOLERANCE, msg=what)

    def test_the_humanoid_follows_the_axis_vectors_in_any_orientation(self):
        for number, case in enumerate(CASES):
            turned = number % 2 == 1
            said = self.show(turned, poses=[case["mocap"]])
            self.assertEqual(said["status"], "all is well")
            x, y, z = (2 * v for v in case["unity"]["position"])
            # A character at (1, 0, 0), rotated to the right by 90 degrees about the up axis: forward is +x, right is -z.
            self.assert_near(said["hips"], [1 + z, y, -x] if turned else [x, y, z], case["name"])
            self.assert_near(said["rotation_xyzw"], case["unity"]["rotation_xyzw"], case["name"])

    def test_a_prop_and_markers_and_figures_are_shown_beside_the_person(self):
        case = CASES[3]
        said = self.show(subjects=2, bones=[("Hips", "Spine", "LeftToes"), "Body"], poses=[STANDING, case["mocap"]], points=[(1.0, 0.5, 2.0)])

        self.assertEqual(said["prop_status"], "'actor1' is tracked")
        x, y, z = case["unity"]["position"]
        self.assert_near(said["prop"], [x, y, z + 5], "the parent of the prop is 5 m in front of the origin")
        self.assert_near(said["prop_xyzw"], case["unity"]["rotation_xyzw"], "prop")
        self.assertEqual(said["humanoid"], "'actor' is tracked; the character has no LeftToes")
        self.assertEqual(said["figures"], "2 bones")
        self.assertEqual([marker[:2] for marker in said["markers"]], [["actor", "M"], ["actor1", "M"], ["", ""]])
        # A point at x forward 1, y left 0.5, z up 2 is in Unity at x right -0.5, y up 2, z forward 1.
        self.assert_near(said["markers"][2][2], [-0.5, 2, 1], "unlabelled marker")
        self.assertEqual(said["log"], ["warning: mocap: 'actor': the character has no LeftToes"])

    def test_a_silent_feed_shows_nothing_and_freezes_the_character(self):
        fake = FakeFeed(bones=[("Hips", "Spine"), "Body"], poses=[STANDING, STANDING])
        self.addCleanup(fake.close)
        environment = {**os.environ, "LD_LIBRARY_PATH": str(self.root / "Runtime/Plugins/x86_64")}
        scene = subprocess.Popen(["mono", "Scene.exe", fake.endpoint, "0", "2", "until-silent"], cwd=self.out, stdout=subprocess.PIPE,
                                 text=True, env=environment)
        self.addCleanup(scene.stdout.close)
        before = json.loads(scene.stdout.readline())
        self.assertEqual((before["prop_tracked"], before["shown_markers"], before["shown_lines"]), (True, 2, 1))
        fake.close()

        said = json.loads(scene.stdout.readline())

        self.assertEqual(scene.wait(60), 0)
        self.assertIn("nothing listens at " + fake.endpoint, said["status"])
        for component in ("humanoid", "prop_status", "figures"):
            self.assertEqual(said[component], said["status"])
        self.assertEqual((said["prop_tracked"], said["shown_markers"], said["shown_lines"], said["markers"]), (False, 0, 0, []))
        self.assert_near(said["hips"], [0, 2, 0], "the character stands where it was, although the Animator moved it")

    def test_a_receiver_that_was_written_for_version_0_2_0_compiles(self):
        self.compile("library", "OldReceiver.dll", ["UnityEngine.dll", "Mocapd.dll"], [STAND_INS / "OldReceiver.cs"])

    def test_a_component_names_what_the_feed_has_instead(self):
        said = self.show(bones=["Hips"])
        self.assertEqual(said["prop_status"], "no prop in the feed: its subjects are actor")

    def test_a_character_that_cannot_be_animated_is_named_with_a_remedy(self):
        said = dict(line.split(": ", 1) for line in self.run_program("Characters.exe").splitlines())
        self.assertEqual(said["whole"], "")
        for what, reason in (("no animator", "no Animator"), ("no avatar", "'Humanoid'"), ("invalid", "'Hero' is invalid"),
                             ("generic", "'Hero' is not humanoid"), ("A-pose", "right upper arm is not horizontal")):
            self.assertIn(reason, said[what])
        self.assertIn("bones without a Transform: Head, LeftHand. ", said["missing"])
        self.assertRegex(said["component"], "^False, the Animator has no avatar.*, 1 message$")


if __name__ == "__main__":
    unittest.main()
