"""Control, health and events in the clients in C, Python and C# (Mono) with a real daemon, and the packages that contain them: a
wheel in a virtual environment without a network, and a NuGet package."""

import json
import os
import pathlib
import shutil
import subprocess
import time
import unittest
import zipfile

from control_test import Daemon, until
from harness import BIN, SOURCE, Desk, free_port

BUILD = BIN.parent
LONG_S = 60
# A client that gives up at its timeout (5 s) takes longer, on any machine.
AT_ONCE_S = 4.0
ENVIRONMENT = {**os.environ, "PYTHONPATH": f"{BUILD / 'python'}:{SOURCE / 'tools/clients/python'}", "LD_LIBRARY_PATH": str(BUILD / "lib")}
DONE, INVALID, NOT_FOUND, FORBIDDEN = 1, 2, 3, 4
STREAMING, STOPPED = 2, 6
NOTHING_LISTENS, KEY_REFUSED, SERVER_KEY_WRONG = 1, 4, 5
# Which fault is seen without a key depends on the side that closes the connection first; the sentence has the reason.
KEY_MISSING = (2, 3)
KEYS = '\n[security]\nserver_key = "server.key"\nallowed_keys = "allowed.keys"\n'


def commands():
    known = {"c": [str(BIN / "clients_control_probe")], "python": ["/usr/bin/python3", str(SOURCE / "tests/clients/control_probe.py")]}
    if shutil.which("mono") and (BUILD / "lib/csharp/ControlProbe.exe").exists():
        known["csharp"] = ["mono", str(BUILD / "lib/csharp/ControlProbe.exe")]
    return known


COMMANDS = commands()


class Probe:
    """A running client, which executes commands."""

    def __init__(self, test, client, control, feed, server_key="-", secret_key="-"):
        self.process = subprocess.Popen([*COMMANDS[client], control, feed, str(server_key), str(secret_key)], stdin=subprocess.PIPE,
                                        stdout=subprocess.PIPE, text=True, env=ENVIRONMENT)
        test.addCleanup(self.end)
        self.client = client

    def end(self):
        self.process.stdin.close()
        self.process.wait(LONG_S)
        self.process.stdout.close()

    def ask(self, *words):
        self.process.stdin.write(" ".join(map(str, words)) + "\n")
        self.process.stdin.flush()
        return json.loads(self.process.stdout.readline())


class Clients(unittest.TestCase):
    def setUp(self):
        self.desk = Desk()
        self.addCleanup(self.desk.close)

    def probe(self, client, daemon, *keys):
        return Probe(self, client, daemon.control, self.desk.endpoint, *keys)

    def done(self, probe, *words):
        said = probe.ask(*words)
        self.assertEqual(said["code"], DONE, f"{probe.client} {words[0]}: {said}")
        return said

    def test_csharp_is_tested_if_mono_is_installed(self):
        if shutil.which("mono"):
            self.assertIn("csharp", COMMANDS)

    def test_each_client_sends_every_request(self):
        daemon = Daemon(self.desk)
        until(daemon.status, "an answer")
        body = json.loads(daemon.ctl("description", "--json").stdout)["description"]["subjects"][0]
        offsets = [",".join(str(row.get(key, {}).get(axis, 0.0)) for row in body[rows] for axis in "xyz")
                   for rows, key in (("bones", "restOffsetM"), ("markers", "offsetM"))]
        for client in COMMANDS:
            with self.subTest(client):
                probe = self.probe(client, daemon)
                phases = lambda: {camera["phase"] for camera in probe.ask("status")["cameras"]}  # noqa: E731
                until(lambda: phases() == {STREAMING}, "the cameras stream")
                status = self.done(probe, "status")
                self.assertEqual(([one["name"] for one in status["subjects"]], status["role"]), (["actor"], "operator"))
                self.assertEqual(self.done(probe, "frame")["bones"], len(body["bones"]))

                self.assertIn("stop", self.done(probe, "stop")["message"])
                until(lambda: phases() == {STOPPED}, "the cameras rest")
                self.assertEqual(probe.ask("status")["capturing"], 0)
                self.done(probe, "start")
                until(lambda: phases() == {STREAMING}, "the cameras stream again")

                self.done(probe, "remove", "actor")
                self.assertEqual(probe.ask("status")["subjects"][0]["away"], 1)
                self.done(probe, "add", "actor")
                self.assertEqual(probe.ask("status")["subjects"][0]["away"], 0)
                self.done(probe, "reset", "actor")
                self.done(probe, "fit", "actor", *offsets)
                self.assertEqual(probe.ask("fit", "actor", "1,2,3", "1,2,3")["code"], INVALID)
                self.assertIn("cam2", self.done(probe, "camera", "cam2", 700, "-")["message"])
                self.assertIn("no gain", probe.ask("camera", "cam2", "-", 3)["message"])
                unknown = probe.ask("reset", "nobody")
                self.assertEqual((unknown["code"], unknown["diagnosis"]), (NOT_FOUND, 0))
                self.assertIn("actor", unknown["message"])

    def test_each_client_records_takes(self):
        daemon = Daemon(self.desk)
        until(daemon.status, "an answer")
        for client in COMMANDS:
            with self.subTest(client):
                probe = self.probe(client, daemon)
                until(lambda: {camera["phase"] for camera in probe.ask("status")["cameras"]} == {STREAMING}, "the cameras stream")
                self.assertIn(f"{client}.mcap", self.done(probe, "take-start", client, "a-note")["message"])
                self.done(probe, "take-mark", "-", "jump")
                self.done(probe, "take-next")
                self.assertIn(".mcap", self.done(probe, "take-stop")["message"])
                self.assertNotEqual(probe.ask("take-stop")["code"], DONE)
                takes = list(self.desk.folder.rglob(f"{client}.mcap"))
                self.assertEqual(len(takes), 1)
                shown = json.loads(self.desk.run("mocapctl", "take", "show", takes[0], "--json").stdout)
                self.assertEqual((shown["state"], shown["info"]["notes"]), ("complete", "a-note"))
                self.done(probe, "take-start", f"{client}-cancelled")
                self.done(probe, "take-cancel")
                self.assertEqual(list(self.desk.folder.rglob(f"{client}-cancelled.mcap")), [])

    def test_each_client_sends_the_requests_that_change_the_settings(self):
        daemon = Daemon(self.desk)
        self.desk.write("my.rig.toml", (SOURCE / "config/demo.rig.toml").read_text())
        for client in COMMANDS:
            with self.subTest(client):
                self.desk.write("mocapd.toml", daemon.text().replace(str(SOURCE / "config/demo.rig.toml"), "my.rig.toml")
                                .replace("tpose:20,walk", "tpose:600,walk"))
                until(daemon.status, "an answer")
                probe = self.probe(client, daemon)
                self.done(probe, "reload")
                until(lambda: len(probe.ask("status")["subjects"]) == 1, "the subjects of the configuration")
                self.done(probe, "mask", "-", 10)
                self.done(probe, "add", "wand", SOURCE / "config/markersets/rigid4.toml")
                until(lambda: [one["name"] for one in probe.ask("status")["subjects"]] == ["actor", "wand"], "the new subject")
                self.desk.write("mocapd.toml", daemon.text(more="\n[detect]\ntreshold = 1\n"))
                bad = probe.ask("reload")
                self.assertEqual(bad["code"], INVALID)
                self.assertIn("did you mean 'threshold'", bad["message"])

    def test_each_client_reports_health_and_events(self):
        daemon = Daemon(self.desk)
        until(daemon.status, "an answer")
        probes = [self.probe(client, daemon) for client in COMMANDS]
        for probe in probes:  # each connects before the event
            until(lambda p=probe: p.ask("health")["sets"] > 0, f"{probe.client}: a report")
        for probe in probes:
            self.assertEqual([camera["name"] for camera in probe.ask("health")["cameras"]], ["cam1", "cam2", "cam3", "cam4"])
            probe.ask("events")
        daemon.ctl("subject", "remove", "actor")
        daemon.ctl("subject", "add", "actor")
        daemon.ctl("capture", "stop")
        for probe in probes:
            seen = []
            until(lambda p=probe, s=seen: s.extend(p.ask("events")["events"]) or any(one["name"] in ("actor", "cam1") for one in s),
                  f"{probe.client}: an event")

    def test_an_unknown_name_is_answered_with_the_names_that_exist(self):
        daemon = Daemon(self.desk)
        until(daemon.status, "an answer")
        for client in COMMANDS:
            probe = self.probe(client, daemon)
            until(lambda p=probe: p.ask("health")["sets"] > 0, "the feed")
            self.assertGreaterEqual(probe.ask("bone", "Head")["index"], 0, client)
            for what, wrong, near, another in (("bone", "head", "Head", "Hips"), ("bone", "LeftUperArm", "LeftUpArm", "Hips")):
                said = probe.ask(what, wrong)
                self.assertEqual(said["index"], -1, client)
                self.assertIn(f"'actor' has no {what} '{wrong}', did you mean '{near}'?", said["fault"], client)
                self.assertIn(another, said["fault"], client)
            said = probe.ask("marker", "qqqqqqqq")
            self.assertIn("'actor' has no marker 'qqqqqqqq'; its markers are ", said["fault"], client)

    def test_each_client_says_at_once_why_no_answer_comes(self):
        for name in ("server", "anna", "viewer", "stranger"):
            self.assertEqual(self.desk.run("mocapctl", "keys", "new", f"{name}.key").returncode, 0)
        for name, role in (("anna", "operator"), ("viewer", "viewer")):
            self.desk.run("mocapctl", "keys", "allow", f"{name}.key", "--name", name, "--role", role)
        daemon = Daemon(self.desk, more=KEYS)
        file = lambda name: self.desk.folder / f"{name}.key"  # noqa: E731
        keys = ("--server-key", file("server"), "--secret-key", file("anna"))
        until(lambda: daemon.ctl("status", keys=keys).returncode == 0, "an answer")
        nobody = f"tcp://127.0.0.1:{free_port()}"
        cases = [(nobody, (), (NOTHING_LISTENS,), "nothing listens at " + nobody),
                 (daemon.control, (), KEY_MISSING, "requires a key"),
                 (daemon.control, (file("server"), file("stranger")), (KEY_REFUSED,), "does not know the public key of this client"),
                 (daemon.control, (file("stranger"), file("anna")), (SERVER_KEY_WRONG,), "does not have the server key of this client")]
        for client in COMMANDS:
            for control, own, codes, reason in cases:
                with self.subTest(client=client, reason=reason):
                    probe = Probe(self, client, control, self.desk.endpoint, *own)
                    probe.ask("health")  # the program runs
                    began = time.monotonic()
                    said = probe.ask("status")
                    self.assertLess(time.monotonic() - began, AT_ONCE_S)
                    self.assertEqual(said["code"], 0)
                    self.assertIn(said["diagnosis"], codes, said)
                    self.assertIn(reason, said["message"])
                    self.assertIn("[control] endpoint" if codes == (NOTHING_LISTENS,) else "", said["message"])
            viewer = self.probe(client, daemon, file("server"), file("viewer"))
            self.assertEqual(viewer.ask("status")["role"], "viewer", client)
            refused = viewer.ask("stop")
            self.assertEqual((refused["code"], refused["diagnosis"]), (FORBIDDEN, 0), client)
            self.assertIn("role operator", refused["message"])
            self.done(self.probe(client, daemon, file("server"), file("anna")), "stop")

    def test_a_client_continues_after_a_restart_of_the_daemon(self):
        daemon = Daemon(self.desk)
        until(daemon.status, "an answer")
        probes = [self.probe(client, daemon) for client in COMMANDS]
        for probe in probes:
            self.done(probe, "status")
        daemon.program.end()
        for probe in probes:
            self.assertEqual(probe.ask("status")["diagnosis"], NOTHING_LISTENS, probe.client)
        daemon.program = self.desk.start("mocapd", "--config", daemon.config)
        until(daemon.status, "an answer")
        for probe in probes:
            until(lambda p=probe: p.ask("status")["code"] == DONE, f"{probe.client} asks again")


class Packages(unittest.TestCase):
    """Each package is built by its one command, installed, and runs the examples with a real daemon."""

    @classmethod
    def setUpClass(cls):
        cls.desk = Desk()
        cls.addClassCleanup(cls.desk.close)
        cls.daemon = Daemon(cls.desk)
        until(lambda: (s := cls.daemon.status()) and s["subjects"][0]["phase"] == "SUBJECT_PHASE_TRACKING", "the subject is tracked")

    def run_ok(self, *command, **options):
        ended = subprocess.run([str(part) for part in command], capture_output=True, text=True, cwd=self.desk.folder, timeout=300, **options)
        self.assertEqual(ended.returncode, 0, ended.stdout + ended.stderr)
        return ended.stdout

    def assert_runs(self, example, control, **options):
        self.assertRegex(self.run_ok(*example, self.desk.endpoint, "3", **options), r"actor's Hips at ")
        said = self.run_ok(*control, "stop", self.daemon.control, **options)
        self.assertIn("capture is stopped, you are operator", said)
        said = self.run_ok(*control, "start", self.daemon.control, **options)
        self.assertIn("capture runs", said)
        self.assertRegex(said, r"cam4: .* Hz, \d+ frames")
        nobody = f"tcp://127.0.0.1:{free_port()}"
        ended = subprocess.run([*map(str, control), "status", nobody], capture_output=True, text=True, timeout=LONG_S, **options)
        self.assertNotEqual(ended.returncode, 0)
        self.assertIn(f"nothing listens at {nobody}", ended.stderr)

    def test_the_wheel_is_installed_without_a_network_and_runs(self):
        if subprocess.run(["/usr/bin/python3", "-c", "import setuptools, wheel, pip, venv, ensurepip"], capture_output=True).returncode != 0:
            self.skipTest("python3-pip, python3-setuptools, python3-wheel or python3-venv is not installed")
        self.assertIn("usage: ", self.run_ok(SOURCE / "tools/clients/python/build_wheel.sh", "--help"))
        wheel = self.run_ok(SOURCE / "tools/clients/python/build_wheel.sh", "out put").strip()
        self.run_ok("/usr/bin/python3", "-m", "venv", "--system-site-packages", "venv")
        python = self.desk.folder / "venv/bin/python"
        self.run_ok(python, "-m", "pip", "install", "--quiet", "--no-index", wheel)
        environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
        examples = SOURCE / "tools/clients/python"
        self.assertIn("venv", self.run_ok(python, "-c", "import mocap_client; print(mocap_client.__file__)", env=environment))
        self.assert_runs((python, examples / "example.py"), (python, examples / "control_example.py"), env=environment)

    @unittest.skipUnless(shutil.which("mono") and shutil.which("mcs") and shutil.which("zip"), "mono, mcs or zip is not installed")
    def test_the_nuget_package_is_complete_and_runs(self):
        pack = SOURCE / "tools/clients/csharp/pack.sh"
        self.assertIn("usage: ", self.run_ok(pack, "--help"))
        windows = self.desk.folder / "windows"
        windows.mkdir()
        (windows / "mocap_client.dll").write_bytes(b"MZ")
        made = pathlib.Path(self.run_ok(pack, "out", BUILD / "lib/libmocap_client.so", "--windows", windows).strip())
        with zipfile.ZipFile(made) as archive:
            archive.extractall(self.desk.folder / "unpacked")
            names = set(archive.namelist())
        expected = {"Mocapd.Client.nuspec", "[Content_Types].xml", "_rels/.rels", "README.md", "LICENSE", "lib/netstandard2.0/MocapClient.dll",
                    "runtimes/linux-x64/native/libmocap_client.so", "runtimes/win-x64/native/mocap_client.dll"}
        self.assertEqual(names, expected)
        folder = made.with_suffix("")
        self.assertEqual({str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file()}, expected)
        library = self.desk.folder / "unpacked/lib/netstandard2.0/MocapClient.dll"
        shutil.copy(library, self.desk.folder)
        for name in ("Example", "ControlExample"):
            self.run_ok("mcs", "-nologo", f"-r:{library}", f"-out:{name}.exe", SOURCE / f"tools/clients/csharp/{name}.cs")
        environment = {**os.environ, "LD_LIBRARY_PATH": str(self.desk.folder / "unpacked/runtimes/linux-x64/native")}
        at = self.desk.folder
        self.assert_runs(("mono", at / "Example.exe"), ("mono", at / "ControlExample.exe"), env=environment)
        refused = subprocess.run([pack, "out", "nothing.so"], capture_output=True, text=True)
        self.assertEqual(refused.returncode, 64)
        self.assertIn("no such file", refused.stderr)

    def test_the_c_examples_run(self):
        example, control = BIN / "mocap_example", BIN / "mocap_control_example"
        self.assertIn("Hips", self.run_ok(example, self.desk.endpoint, "2"))
        self.assertIn("capture is stopped", self.run_ok(control, "stop", self.daemon.control))
        self.assertRegex(self.run_ok(control, "start", self.daemon.control), r"capture runs[^\n]*\n(cam\d: .* frames.*\n){4}")


if __name__ == "__main__":
    unittest.main(verbosity=2)
