"""The Unreal plugin: its packed folder and rules, and its source and panel with stand-ins for the engine and a real feed."""

import datetime
import json
import os
import re
import shutil
import subprocess
import time
import unittest

import zmq

from fake_feed import STANDING, FakeFeed
from harness import BIN, SOURCE, Desk, free_port

LIBRARY = BIN.parent / "lib/libmocap_client.so"
UNREAL = SOURCE / "tools/clients/unreal"
STAND_INS = SOURCE / "tests/clients/unreal"
CASES = [json.loads(path.read_text()) for path in sorted((SOURCE / "proto/axes").glob("*.json"))]
TOLERANCE = 1e-5  # single precision; positions are multiples of a power of two


def pack(*arguments):
    return subprocess.run([UNREAL / "pack.sh", *arguments], capture_output=True, text=True)


def times(q, p):
    """The product of two quaternions x y z w."""
    (ax, ay, az, aw), (bx, by, bz, bw) = q, p
    return [aw * bx + ax * bw + ay * bz - az * by, aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw, aw * bw - ax * bx - ay * by - az * bz]


class Packed(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.desk = Desk()
        cls.addClassCleanup(cls.desk.close)
        windows = cls.desk.folder / "windows"
        windows.mkdir()
        (windows / "mocap_client.dll").write_bytes(b"MZ")
        made = pack(cls.desk.folder, "--windows", windows, LIBRARY)
        assert made.returncode == 0, made.stderr
        cls.plugin = cls.desk.folder / "MocapLiveLink"

    def run_plugin(self, *arguments, plugin=None, code=0):
        ended = subprocess.run([BIN / "clients_unreal", *map(str, arguments)], capture_output=True, text=True, timeout=120,
                               env={**os.environ, "PLUGIN_FOLDER": str(plugin or self.plugin)})
        self.assertEqual(ended.returncode, code, ended.stdout + ended.stderr)
        return json.loads(ended.stdout)

    def feed(self, **options):
        feed = FakeFeed(**options)
        self.addCleanup(feed.close)
        return feed


class Plugin(Packed):
    """The folder that a user copies into a project."""

    def test_the_descriptor_names_a_module_that_exists_for_each_shipped_platform(self):
        descriptor = json.loads((self.plugin / "MocapLiveLink.uplugin").read_text())
        self.assertEqual(descriptor["FileVersion"], 3)
        self.assertRegex(descriptor["VersionName"], r"^\d+\.\d+\.\d+$")
        self.assertIn({"Name": "LiveLink", "Enabled": True}, descriptor["Plugins"])
        libraries = {path.name for path in (self.plugin / "ThirdParty/mocap_client/lib").iterdir()}
        for module in descriptor["Modules"]:
            folder = self.plugin / "Source" / module["Name"]
            self.assertTrue((folder / f"{module['Name']}.Build.cs").is_file())
            self.assertEqual(set(module["PlatformAllowList"]), libraries)
            sources = "".join(path.read_text() for path in folder.rglob("*.cpp"))
            self.assertIn(f"IMPLEMENT_MODULE(FDefaultModuleImpl, {module['Name']})", sources)
        self.assertEqual(set(descriptor["SupportedTargetPlatforms"]), libraries)
        for name in ("README.md", "LICENSE", "retarget.svg", "ThirdParty/mocap_client/LICENSES.md"):
            self.assertTrue((self.plugin / name).is_file(), name)

    def test_a_header_with_a_class_of_the_engine_includes_its_generated_header_last(self):
        for header in self.plugin.rglob("*.h"):
            if "UCLASS(" in header.read_text():
                includes = re.findall(r'#include [<"](.*)[>"]', header.read_text())
                self.assertEqual(includes[-1], header.stem + ".generated.h")

    def test_no_name_of_a_source_file_occurs_in_another_because_the_engine_joins_them(self):
        owners = {}
        for source in self.plugin.rglob("*.cpp"):
            local = "".join(re.findall(r"^namespace \{\n(.*?)^\}  // namespace$", source.read_text(), re.MULTILINE | re.DOTALL))
            for name in re.findall(r"^(?:constexpr |const |struct |class |[\w*&:]+ )+\*?(?:const )?(\w+)(?: = |\[|\(|;| \{)", local, re.MULTILINE):
                self.assertEqual(owners.setdefault(name, source.name), source.name, name)
        self.assertIn("kMeshFromActor", owners)

    @unittest.skipUnless(shutil.which("mcs") and shutil.which("mono"), "mono-mcs is not installed")
    def test_the_build_rules_stage_the_library_of_the_platform_or_say_what_to_do(self):
        rules = self.desk.folder / "Rules.exe"
        subprocess.run(["mcs", "-nologo", "-langversion:5", "-warnaserror", f"-out:{rules}", STAND_INS / "UnrealBuildTool.cs",
                        self.plugin / "Source/MocapLiveLink/MocapLiveLink.Build.cs"], check=True)
        client = self.plugin / "ThirdParty/mocap_client"
        for platform, library in (("Linux", "libmocap_client.so"), ("Win64", "mocap_client.dll")):
            said = subprocess.run(["mono", rules, self.plugin, platform], check=True, capture_output=True, text=True).stdout.splitlines()
            self.assertIn(f"staged NonUFS {client}/lib/{platform}/{library}", said)
            self.assertIn(f"include {client}/include", said)
            self.assertLessEqual({f"module {name}" for name in ("LiveLinkInterface", "Projects", "Slate", "SlateCore")}, set(said))
        without = subprocess.run(["mono", rules, UNREAL / "MocapLiveLink", "Linux"], capture_output=True, text=True)
        self.assertEqual(without.returncode, 1)
        self.assertIn("tools/clients/unreal/pack.sh", without.stderr)

    def test_pack_refuses_wrong_arguments_with_a_reason(self):
        for arguments, code, reason in (((), 64, "usage"), ((self.desk.folder,), 64, "no native library"),
                                        (("/nowhere", LIBRARY), 66, "not a folder"),
                                        ((self.desk.folder, LIBRARY), 73, "exists"),
                                        ((self.desk.folder, "/nowhere.so"), 66, "mocap_client first"),
                                        ((self.desk.folder, "--windows", self.plugin), 66, "no mocap_client.dll")):
            made = pack(*arguments)
            self.assertEqual(made.returncode, code, arguments)
            self.assertIn(reason, made.stderr)

    def test_a_missing_library_is_named_with_a_remedy(self):
        said = self.run_plugin("run", "", 1, 1, 0, plugin=UNREAL / "MocapLiveLink", code=1)
        self.assertIn("ThirdParty/mocap_client/lib/Linux/libmocap_client.so", said["status"])
        self.assertIn("pack.sh", said["status"])

    def test_the_picture_of_the_retarget_note_is_up_to_date(self):
        drawn = subprocess.run([UNREAL / "draw_retarget.py", "-"], check=True, capture_output=True, text=True).stdout
        self.assertEqual(drawn, (UNREAL / "retarget.svg").read_text())


class Source(Packed):
    """What Live Link receives."""

    def assert_pose(self, pose, position, rotation, what):
        for found, wanted in zip(pose["position"] + pose["rotation_xyzw"], [*position, *rotation], strict=True):
            self.assertAlmostEqual(found, wanted, delta=TOLERANCE, msg=what)

    def test_a_person_is_a_skeleton_with_the_axis_vectors(self):
        feed = self.feed(bones=[(case["bone"], "Spine") for case in CASES], poses=[case["mocap"] for case in CASES])
        said = self.run_plugin("run", feed.endpoint, 20, 1, 0)
        self.assertEqual((said["status"], said["machine"]), ("all is well", feed.endpoint))
        for i, case in enumerate(CASES):
            subject = said["subjects"][f"actor{i}" if i else "actor"]
            self.assertEqual((subject["role"], subject["descriptions"]), ("Animation", 1))
            self.assertEqual(subject["bones"], [["pelvis", -1], ["Spine", 0]])
            self.assertTrue(0.0 <= subject["age_s"] < 5.0, subject["age_s"])
            self.assert_pose(subject["poses"][0], case["unreal"]["position"], case["unreal"]["rotation_xyzw"], case["name"])
            self.assert_pose(subject["poses"][1], [0, 0, 25], [0, 0, 0, 1], "25 cm above its parent")

    def test_a_lost_bone_has_its_rest_pose_relative_to_its_parent(self):
        feed = self.feed(bones=[("Hips", "Spine")], lost=[(0, 1)])
        said = self.run_plugin("run", feed.endpoint, 5, 1, 0)["subjects"]["actor"]
        self.assert_pose(said["poses"][1], [0, 0, 25], [0, 0, 0, 1], "25 cm above its parent")

    def test_no_frame_has_a_lost_root(self):
        feed = self.feed(bones=[("Hips", "Spine"), "Body"], poses=[STANDING, STANDING])
        source = subprocess.Popen([BIN / "clients_unreal", "run", feed.endpoint, "300", "1", "0"], stdout=subprocess.PIPE,
                                  stderr=subprocess.PIPE, text=True, env={**os.environ, "PLUGIN_FOLDER": str(self.plugin)})
        self.assertEqual(source.stderr.readline(), "shown\n")
        feed.lost = [(0, 0), (1, 0)]
        before = feed.sent
        while feed.sent < before + 20:
            time.sleep(0.01)
        feed.lost = []
        out, _ = source.communicate(timeout=120)
        for name, subject in json.loads(out)["subjects"].items():
            self.assertAlmostEqual(subject["farthest_cm"], 100, delta=1e-3, msg=name)

    def test_a_prop_is_a_transform(self):
        case = CASES[3]
        feed = self.feed(bones=[("Hips", "Spine"), "Body"], poses=[STANDING, case["mocap"]])
        said = self.run_plugin("run", feed.endpoint, 5, 1, 0)["subjects"]
        self.assertEqual((said["actor"]["role"], said["actor1"]["role"]), ("Animation", "Transform"))
        self.assert_pose(said["actor1"]["poses"][0], case["unreal"]["position"], case["unreal"]["rotation_xyzw"], "prop")

    def test_mesh_axes_face_y_as_the_mannequin_does(self):
        case = CASES[3]
        feed = self.feed(bones=[("Hips", "Spine")], poses=[case["mocap"]])
        said = self.run_plugin("run", f"endpoint={feed.endpoint};axes=mesh", 5, 1, 0)["subjects"]["actor"]
        x, y, z = case["unreal"]["position"]
        quarter = [0, 0, 0.5 ** 0.5, 0.5 ** 0.5]  # x to y
        turn = times(times(quarter, case["unreal"]["rotation_xyzw"]), [0, 0, -quarter[2], quarter[3]])
        self.assert_pose(said["poses"][0], [-y, x, z], turn, "forward is y, right is -x")

    def test_every_frame_has_the_timecode_of_the_daemon(self):
        for drop, rate, frame in ((False, [25, 1], ((10 * 60 + 20) * 60 + 30) * 25 + 7),
                                  # of 620 minutes, all but each tenth skip two numbers
                                  (True, [30000, 1001], ((10 * 60 + 20) * 60 + 30) * 30 + 7 - 2 * (620 - 62))):
            feed = self.feed(timecode={"hours": 10, "minutes": 20, "seconds": 30, "frames": 7,
                                       "frames_per_second": 30 if drop else 25, "drop_frame": drop})
            scene = self.run_plugin("run", feed.endpoint, 5, 1, 0)["subjects"]["actor"]["scene"]
            self.assertEqual((scene["rate"], scene["frame"]), (rate, frame))
            self.assertGreater(scene["fraction"], 0.0, "later frames of the same timecode")
            self.assertLess(scene["fraction"], 1.0)

    def test_without_timecode_every_frame_has_the_local_time_of_day(self):
        feed = self.feed()
        scene = self.run_plugin("run", feed.endpoint, 5, 1, 0)["subjects"]["actor"]["scene"]
        self.assertEqual(scene["rate"], [100, 1])
        local = datetime.datetime.now(datetime.timezone.utc) + datetime.timedelta(hours=2)  # as the stand-ins have it
        now = (local - local.replace(hour=0, minute=0, second=0, microsecond=0)).total_seconds()
        behind = (now - scene["frame"] / 100) % 86400
        self.assertLess(behind, 60)

    def test_after_a_restart_the_skeleton_is_sent_again_and_a_missing_subject_removed(self):
        port = free_port()
        first = FakeFeed(port=port, session="first", bones=["Hips", "Body"], poses=[STANDING, STANDING])
        source = subprocess.Popen([BIN / "clients_unreal", "run", first.endpoint, "20", "2", "1"], stdout=subprocess.PIPE,
                                  stderr=subprocess.PIPE, text=True,
                                  env={**os.environ, "PLUGIN_FOLDER": str(self.plugin)})
        self.assertEqual(source.stderr.readline(), "shown\n")
        first.close()
        self.feed(port=port, session="second", version=2)
        out, _ = source.communicate(timeout=120)
        said = json.loads(out)
        self.assertEqual((list(said["subjects"]), said["removed"]), (["actor"], 1))
        self.assertEqual(said["subjects"]["actor"]["descriptions"], 2)


class Panel(Packed):
    """The panel of the editor, and the connection string that a preset keeps."""

    def test_the_panel_creates_a_source_with_the_address_and_the_axes(self):
        for address, endpoint in (("-", "tcp://127.0.0.1:5570"), ("", "tcp://127.0.0.1:5570"), (" studio ", "tcp://studio:5570"),
                                  ("10.0.0.7:6000", "tcp://10.0.0.7:6000"), ("[::1]", "tcp://[::1]:5570"),
                                  ("ipc:///run/mocapd/feed", "ipc:///run/mocapd/feed")):
            said = self.run_plugin("panel", address, "", "", 0)
            self.assertEqual((said["menu"], said["fields"], said["handled"], said["created"]), (0, 3, 1, 1), said)
            self.assertEqual(said["connection"], "endpoint=" + endpoint)
        self.assertEqual(self.run_plugin("panel", "studio", "", "", 1)["connection"], "endpoint=tcp://studio:5570;axes=mesh")

    def test_the_panel_takes_keys_and_the_source_uses_them(self):
        server, ours = (tuple(key.decode() for key in zmq.curve_keypair()) for _ in range(2))
        feed = self.feed(keys=[key.encode() for key in server], allowed={ours[0].encode()})
        own_file = self.desk.write("own.key", f"public {ours[0]}\nsecret {ours[1]}\n")
        said = self.run_plugin("panel", feed.endpoint, server[0], own_file, 0)
        self.assertEqual(said["created"], 1)
        self.assertEqual(said["connection"], f"endpoint={feed.endpoint};server_key={server[0]};secret_key={own_file}")
        self.assertEqual(self.run_plugin("run", said["connection"], 5, 1, 0)["status"], "all is well")

    def test_the_panel_shows_a_fault_and_creates_nothing(self):
        for arguments, reason in ((("studio", "short", ""), "server_key is neither a key"), (("tcp://nonsense", "", ""), "tcp://ADDRESS:PORT"),
                                  (("studio", "", "/a;b"), "secret_key contains ';'")):
            said = self.run_plugin("panel", *arguments, 0)
            self.assertEqual((said["created"], said["connection"]), (0, ""))
            self.assertTrue(any(reason in text for text in said["texts"]), said["texts"])

    def test_a_connection_string_is_read_and_written(self):
        every_sign = "0123456789abcdefghijABCDEFGHIJ.-:+=^!/*?"  # signs of a key, among them '='
        full = f"endpoint=tcp://a:1;server_key={every_sign};secret_key=/k/own key;public_key={every_sign};axes=mesh"
        for text, endpoint, written in ((full, "tcp://a:1", full), ("", "tcp://127.0.0.1:5570", "endpoint=tcp://127.0.0.1:5570"),
                                        ("tcp://b:2", "tcp://b:2", "endpoint=tcp://b:2"),
                                        ("endpoint=c;later=1", "tcp://c:5570", "endpoint=tcp://c:5570")):
            said = self.run_plugin("settings", text)
            self.assertEqual((said["endpoint"], said["text"]), (endpoint, written))


if __name__ == "__main__":
    unittest.main()
