"""mocap-watch and mocapctl at a daemon with keys and at closed ports: keys in every mode, and the reason of a failed
connection within about a second."""

import json
import subprocess
import time
import unittest

from harness import BIN, Desk, free_port, synthetic_volume

# A program that gives up at its former limits (5 s for an answer, 4 s of --doctor) takes longer, on any machine.
AT_ONCE_S = 3.5
LONG_S = 60

KEYS = '\n[security]\nserver_key = "server.key"\nallowed_keys = "allowed.keys"\n'


class Connect(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.desk = Desk()
        cls.addClassCleanup(cls.desk.close)
        for name in ("server", "anna", "stranger"):
            assert cls.desk.run("mocapctl", "keys", "new", f"{name}.key").returncode == 0
        assert cls.desk.run("mocapctl", "keys", "allow", "anna.key", "--name", "anna").returncode == 0
        cls.feed = cls.desk.endpoint
        cls.control = control_of(cls.feed)
        cls.daemon = cls.desk.start("mocapd", "--config", cls.desk.write("keys.toml", synthetic_volume(cls.feed) + KEYS))
        keys = ("--server-key", "server.key", "--secret-key", "anna.key")
        limit = time.monotonic() + LONG_S
        while cls.desk.run("mocapctl", "status", "--endpoint", cls.control, *keys).returncode != 0:
            assert time.monotonic() < limit, cls.daemon.output()

    def keys(self, server="server", own="anna", option="--secret-key"):
        return ("--server-key", f"{server}.key", option, f"{own}.key")

    def watch(self, *arguments):
        return self.desk.run("mocap-watch", self.feed, *arguments)

    def test_watch_takes_keys_in_every_mode(self):
        live = self.watch("--frames", "3", "--seconds", str(LONG_S), *self.keys())
        self.assertEqual(live.returncode, 0, live.stderr)
        lines = self.watch("--json", "--frames", "3", "--seconds", str(LONG_S), *self.keys())
        self.assertEqual(len([json.loads(line) for line in lines.stdout.splitlines()]), 3, lines.stderr)
        summary = self.watch("--summary", "-", "--frames", "3", "--seconds", str(LONG_S), *self.keys())
        self.assertGreaterEqual(json.loads(summary.stdout.splitlines()[-1])["frames"], 3, summary.stderr)
        # The doctor's answer depends on the actor; a key would be missing with exit code 13.
        self.assertIn(self.watch("--doctor", *self.keys()).returncode, (0, 20), self.daemon.output())
        self.assertEqual(self.watch("--json", "--frames", "1", *self.keys(option="--key")).returncode, 0)

    def test_the_help_shows_one_name_of_each_key_option(self):
        for program in (("mocap-watch",), ("mocapctl", "status"), ("mocap-vmc",)):
            text = self.desk.run(*program, "--help").stdout
            self.assertIn("--server-key", text)
            self.assertIn("--secret-key", text)
            self.assertNotIn("--key", text)

    def faults(self):
        other = f"tcp://127.0.0.1:{free_port()}"
        return [
            (other, other, (), "nothing listens at"),
            (self.feed, self.control, (), "requires a key"),
            (self.feed, self.control, self.keys(own="stranger"), "does not know the public key of this client"),
            (self.feed, self.control, self.keys(server="stranger"), "does not have the server key of this client"),
            (self.control, self.feed, self.keys(), "compare the port with"),
        ]

    def test_mocapctl_says_at_once_why_no_answer_comes(self):
        for _, control, keys, reason in self.faults():
            with self.subTest(reason):
                began = time.monotonic()
                ended = self.desk.run("mocapctl", "status", "--endpoint", control, "--timeout-s", "60", *keys)
                self.assertLess(time.monotonic() - began, AT_ONCE_S)
                self.assertEqual(ended.returncode, 69, ended.stderr)
                self.assertIn(reason, ended.stderr)

    def test_watch_says_at_once_why_no_data_comes(self):
        for feed, _, keys, reason in self.faults():
            with self.subTest(reason):
                began = time.monotonic()
                program = subprocess.Popen([BIN / "mocap-watch", feed, *keys], cwd=self.desk.folder, text=True, stdout=subprocess.PIPE,
                                           stderr=subprocess.STDOUT)
                try:
                    line = program.stdout.readline()
                    self.assertLess(time.monotonic() - began, AT_ONCE_S)
                    self.assertIn(reason, line)
                finally:
                    program.terminate()
                    program.communicate()

    def test_one_key_without_the_other_is_explained(self):
        for ended in (self.desk.run("mocapctl", "status", "--server-key", "server.key"), self.watch("--secret-key", "anna.key")):
            self.assertEqual(ended.returncode, 64)
            self.assertIn("go together", ended.stderr)

    def test_watch_connects_when_its_key_is_allowed_later(self):
        self.desk.run("mocapctl", "keys", "new", "late.key")
        late = self.desk.start("mocap-watch", self.feed, "--frames", "1", "--seconds", str(LONG_S), *self.keys(own="late"))
        limit = time.monotonic() + LONG_S
        while "does not know the public key" not in late.output() and time.monotonic() < limit:
            time.sleep(0.05)
        self.desk.run("mocapctl", "keys", "allow", "late.key", "--name", "late")
        self.assertEqual(late.wait(LONG_S), 0, late.output())


def control_of(feed):
    host, port = feed.rsplit(":", 1)
    return f"{host}:{int(port) + 1}"


if __name__ == "__main__":
    unittest.main(verbosity=2)
