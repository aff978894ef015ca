"""The client library, its example and mocap-vmc for Windows, run under Wine against the real daemon. The test windows.build
makes them (tools/clients/windows/build.sh)."""

import os
import pathlib
import re
import shutil
import socket
import subprocess
import time
import unittest

from harness import SOURCE, Desk, free_port, synthetic_volume

BUILD = SOURCE / "build/windows"
PACKAGE = BUILD / "mocap-client-windows"
WINE = shutil.which("wine64") or shutil.which("wine64", path="/usr/lib/wine")
COMPILER = "x86_64-w64-mingw32-gcc-posix"
OBJDUMP = "x86_64-w64-mingw32-objdump"
LONG_S = 300

# DLLs of every Windows 10.
WINDOWS_DLLS = {"advapi32.dll", "iphlpapi.dll", "kernel32.dll", "msvcrt.dll", "user32.dll", "winmm.dll", "ws2_32.dll"}
KEYS = '\n[security]\nserver_key = "server.key"\nallowed_keys = "allowed.keys"\n'
os.environ |= {"WINEPREFIX": str(BUILD / "wine"), "WINEDEBUG": "-all", "WINEDLLOVERRIDES": "mscoree,mshtml=", "LC_ALL": "C.UTF-8"}


def reason_to_skip():
    if not shutil.which(COMPILER):
        return f"{COMPILER} is not installed (Debian's g++-mingw-w64-x86-64-posix)"
    if WINE is None:
        return "wine64 is not installed (Debian's wine64)"
    if not (PACKAGE / "bin/mocap_client.dll").exists():
        return f"{PACKAGE} is missing: run tools/clients/windows/build.sh"
    return None


if __name__ == "__main__" and reason_to_skip():
    print(f"windows_test: skipped: {reason_to_skip()}")
    raise SystemExit(77)


class Windows(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        # Wine's own services outlive the program that starts them, and keep its standard output open.
        cls.addClassCleanup(subprocess.run, [f"{pathlib.Path(WINE).parent}/wineserver", "-k"])

    def setUp(self):
        self.desk = Desk()
        self.addCleanup(self.desk.close)

    def start_daemon(self, more=""):
        config = self.desk.write("my.toml", synthetic_volume(self.desk.endpoint) + more)
        return self.desk.start("mocapd", "--config", config)

    def wine(self, program, *arguments):
        return self.desk.start(WINE, PACKAGE / "bin" / program, *arguments)

    def wait_for(self, program, pattern):
        """Returns the first match in the output of a program."""
        limit = time.monotonic() + LONG_S
        while True:
            ended = program.process.poll() is not None
            if found := re.search(pattern, program.output(), re.MULTILINE):
                return found
            if ended or time.monotonic() > limit:
                raise AssertionError(f"no line matches '{pattern}': {program.output()}")
            time.sleep(0.05)

    def new_key(self, name):
        made = self.desk.run("mocapctl", "keys", "new", name)
        self.assertEqual(made.returncode, 0, made.stderr)

    def test_the_example_shows_the_actors_bones(self):
        daemon = self.start_daemon()

        example = self.wine("mocap_example.exe", self.desk.endpoint, 3600)

        frame = self.wait_for(example, r"^frame (\d+), ([-\d.]+) ms old, (\d) of 4 cameras, actor")
        self.assertGreater(float(frame[2]), 0.0, daemon.output())
        hips = [float(number) for number in self.wait_for(example, r"^  Hips +at (\S+) (\S+) (\S+) turned").groups()]
        self.assertTrue(0.5 < hips[2] < 1.5, f"height of the hips, m: {hips}")

    def test_the_example_connects_with_keys_and_tells_a_stranger_why_not(self):
        for name in ("server.key", "stranger.key", "schlüssel von jürgen.key"):
            self.new_key(name)
        self.desk.run("mocapctl", "keys", "allow", "schlüssel von jürgen.key", "--name", "jürgen")
        self.start_daemon(KEYS)

        friend = self.wine("mocap_example.exe", self.desk.endpoint, 3600, "server.key", "schlüssel von jürgen.key")
        stranger = self.wine("mocap_example.exe", self.desk.endpoint, 3600, "server.key", "stranger.key")
        keyless = self.wine("mocap_example.exe", self.desk.endpoint, 3600)

        self.wait_for(friend, r"^frame \d+, .* actor")
        self.wait_for(stranger, "no data: .* does not know the public key of this client")
        self.wait_for(keyless, "no data: .* requires a key")

    def test_the_example_names_a_closed_port(self):
        closed = f"tcp://127.0.0.1:{free_port()}"

        self.wait_for(self.wine("mocap_example.exe", closed, 3600), f"no data: nothing listens at {closed}")

    def test_vmc_sends_the_actor_with_keys(self):
        for name in ("server.key", "anna.key"):
            self.new_key(name)
        self.desk.run("mocapctl", "keys", "allow", "anna.key", "--name", "anna")
        self.start_daemon(KEYS)
        listener = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.addCleanup(listener.close)
        listener.bind(("127.0.0.1", 0))
        listener.settimeout(LONG_S)

        vmc = self.wine("mocap-vmc.exe", self.desk.endpoint, "--port", listener.getsockname()[1], "--server-key", "server.key",
                        "--secret-key", "anna.key")

        limit = time.monotonic() + LONG_S
        packet = b""
        while b"/VMC/Ext/Bone/Pos" not in packet:
            self.assertLess(time.monotonic(), limit, vmc.output())
            packet = listener.recv(65536)
        self.assertEqual(packet[:8], b"#bundle\0")

    def test_vmc_has_version_and_help(self):
        self.wait_for(self.wine("mocap-vmc.exe", "--version"), r"^mocap-vmc \d+\.\d+\.\d+\s*$")
        self.wait_for(self.wine("mocap-vmc.exe", "--help"), "--secret-key")

    def headers(self, name):
        return subprocess.run([OBJDUMP, "-p", PACKAGE / "bin" / name], check=True, capture_output=True, text=True).stdout

    def test_programs_and_dll_need_only_the_dlls_of_windows(self):
        for name in ("mocap_client.dll", "mocap-vmc.exe", "mocap_example.exe"):
            needed = {dll.lower() for dll in re.findall(r"DLL Name: (\S+)", self.headers(name))}

            self.assertLessEqual(needed, WINDOWS_DLLS | {"mocap_client.dll"}, name)
            self.assertEqual("mocap_client.dll" in needed, name == "mocap_example.exe")

    def test_the_dll_exports_the_functions_of_the_header_and_no_others(self):
        table = self.headers("mocap_client.dll").partition("[Ordinal/Name Pointer] Table")[2]
        exported = set(re.findall(r"^\s+\[ *\d+\] (\S+)$", table, re.MULTILINE))

        declared = set(re.findall(r"^MOCAP_API [^(]*?(\w+)\(", (PACKAGE / "include/mocap_client.h").read_text(), re.MULTILINE))
        self.assertEqual(exported, declared)

    def test_microsofts_import_library_links(self):
        program = self.desk.write("abi.c", '#include "mocap_client.h"\nint start(void) { return 40 + mocap_client_abi(); }\n')
        shutil.copy(PACKAGE / "bin/mocap_client.dll", self.desk.folder)
        subprocess.run([COMPILER, "-c", "-I", PACKAGE / "include", program, "-o", self.desk.folder / "abi.obj"], check=True)
        subprocess.run(["lld-link", "-entry:start", "-subsystem:console", "-nodefaultlib", f"-out:{self.desk.folder}/abi.exe",
                        self.desk.folder / "abi.obj", PACKAGE / "lib/mocap_client.lib"], check=True)

        ended = subprocess.run([WINE, self.desk.folder / "abi.exe"], timeout=LONG_S, stdout=subprocess.DEVNULL,
                               stderr=subprocess.DEVNULL)

        self.assertEqual(ended.returncode, 41)

    def test_the_package_has_the_licences_of_its_parts(self):
        names = {path.name for path in (PACKAGE / "licences").iterdir()}

        self.assertLessEqual({"mocap_client.txt", "zeromq.txt", "libsodium.txt", "COPYING.LESSER", "gcc-mingw-w64-base.txt"}, names)


if __name__ == "__main__":
    unittest.main(verbosity=2)
