"""The audit log of a running daemon: who connected, ordered, recorded and changed what. Runs in its own network namespace; a
test that needs the rights of root is skipped without them."""

import json
import pathlib
import re
import signal
import subprocess
import unittest
import urllib.request

from control_test import Daemon, LONG_S, receive, until
from harness import BIN, Desk, free_port

KEYS = '\n[security]\nserver_key = "server.key"\nallowed_keys = "allowed.keys"\n'


class Audit(unittest.TestCase):
    def setUp(self):
        self.desk = Desk()
        self.addCleanup(self.desk.close)
        self.state = self.desk.folder / "state"
        self.state.mkdir()
        self.log = self.state / "audit.jsonl"

    def start(self, more=""):
        return Daemon(self.desk, more=more, options=("--state", self.state))

    def lines(self, **wanted):
        """The lines of the log that have these values."""
        text = self.log.read_text()
        self.assertTrue(text.endswith("\n"))
        all_lines = [json.loads(line) for line in text.splitlines()]
        return [line for line in all_lines if all(line.get(key) == value for key, value in wanted.items())]

    def done(self, asked):
        self.assertEqual(asked.returncode, 0, asked.stderr)
        return asked.stdout

    def make_keys(self, **roles):
        self.done(self.desk.run("mocapctl", "keys", "new", "server.key"))
        for name, role in roles.items():
            self.done(self.desk.run("mocapctl", "keys", "new", f"{name}.key"))
            if role:
                self.done(self.desk.run("mocapctl", "keys", "allow", f"{name}.key", "--name", name, "--role", role))

    def pair(self, name):
        lines = (self.desk.folder / f"{name}.key").read_text().split("\n")
        return {word: value for word, value in (line.split() for line in lines if line[:1] in "ps" and line)}

    def keys(self, name):
        return ("--server-key", "server.key", "--secret-key", f"{name}.key")

    def test_an_order_is_in_the_log_before_it_is_answered(self):
        daemon = self.start()
        until(daemon.status, "an answer")

        for count in range(1, 11):
            self.done(daemon.ctl("subject", "reset", "actor"))
            self.assertEqual(len(self.lines(what="ordered", order="subject reset", name="actor", outcome="done")), count)
        self.done(daemon.ctl("camera", "set", "cam2", "--exposure-us", "700"))
        self.assertNotEqual(daemon.ctl("subject", "reset", "nobody").returncode, 0)

        (order,) = self.lines(what="ordered", order="camera set")
        self.assertRegex(order["answer"], r"exposure_us \d+ -> 700")
        self.assertEqual((order["who"], order["role"]), ("127.0.0.1", "operator"))
        self.assertRegex(order["at"], r"^\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d\.\d{6}Z$")
        self.assertEqual(len(self.lines(what="ordered", name="nobody", outcome="not found")), 1)
        self.assertEqual(self.lines(order="read"), [])
        self.assertEqual(self.log.stat().st_mode & 0o777, 0o640)

        daemon.program.end()
        self.assertEqual(self.lines()[0]["what"], "started")
        self.assertEqual(self.lines()[-1]["what"], "ended")

    def test_a_reload_is_logged_with_each_value_before_and_after(self):
        daemon = self.start()
        until(daemon.status, "an answer")
        version = daemon.version()

        self.desk.write("mocapd.toml", daemon.text(more="\n[detect]\nthreshold = 61\n"))
        self.done(daemon.ctl("reload"))
        until(lambda: daemon.version() > version, "the change")
        self.desk.write("mocapd.toml", daemon.text(more="\n[detect]\nthreshold = 62\n"))
        daemon.program.send(signal.SIGHUP)
        until(lambda: self.lines(setting="detect.threshold", after="62"), "the change")
        self.desk.write("mocapd.toml", daemon.text(more="\n[detect]\ntreshold = 1\n"))
        self.assertEqual(daemon.ctl("reload").returncode, 65)

        (first,) = self.lines(what="changed", setting="detect.threshold", after="61")
        self.assertEqual((first["before"], first["who"]), ("none", "127.0.0.1"))
        (second,) = self.lines(what="changed", setting="detect.threshold", after="62")
        self.assertEqual((second["before"], second["who"]), ("61", "SIGHUP"))
        (bad,) = self.lines(what="ordered", order="reload", outcome="invalid")
        self.assertIn("did you mean 'threshold'", bad["answer"])

    def test_keys_have_names_and_refusals_have_reasons(self):
        self.make_keys(anna="operator", ben="viewer", stranger=None)
        daemon = self.start(more=KEYS)
        until(lambda: self.log.exists(), "the log")
        own, server = self.pair("anna"), self.pair("server")
        anna = daemon.subscriber("snapshot", curve_serverkey=server["public"].encode(),
                                 curve_publickey=own["public"].encode(), curve_secretkey=own["secret"].encode())
        self.assertEqual(receive(anna)[0], "description")

        self.done(daemon.ctl("subject", "reset", "actor", keys=self.keys("anna")))
        self.assertEqual(daemon.ctl("subject", "reset", "actor", keys=self.keys("ben")).returncode, 77)
        self.assertNotEqual(daemon.ctl("status", "--timeout-s", "1", keys=self.keys("stranger")).returncode, 0)
        anna.close()

        (order,) = self.lines(what="ordered", order="subject reset")
        self.assertEqual((order["who"], order["key"], order["role"]), ("anna", own["public"], "operator"))
        until(lambda: self.lines(what="connected", who="anna", socket="feed"), "her connection")
        until(lambda: self.lines(what="disconnected", who="anna", socket="feed"), "its end")
        (forbidden,) = until(lambda: self.lines(what="refused", who="ben"), "the refusal")
        self.assertEqual((forbidden["order"], forbidden["role"]), ("subject", "viewer"))
        self.assertIn("needs the role operator", forbidden["reason"])
        stranger = until(lambda: self.lines(what="refused", key=self.pair("stranger")["public"]), "the refusal")[0]
        self.assertIn("not allowed", stranger["reason"])
        self.done(self.desk.run("mocapctl", "keys", "revoke", "ben"))
        changed = until(lambda: self.lines(what="changed", setting=f"allowed key {self.pair('ben')['public']}"), "the list")[0]
        self.assertEqual((changed["before"], changed["after"]), ("viewer ben", "none"))

        shown = self.done(self.desk.run("mocapctl", "audit", "--file", self.log, "--who", "anna", "--since", "1h"))
        self.assertRegex(shown, r"(?m)^\S+Z  ordered +anna .*order=subject reset")
        self.assertNotIn("ben", shown)

    def test_takes_are_logged_with_who_recorded_them(self):
        daemon = self.start()
        until(daemon.status, "an answer")
        daemon.ctl("snapshot")

        self.done(daemon.ctl("take", "start", "one"))
        until(lambda: self.lines(what="recorded", take="one"), "the begin")
        self.done(daemon.ctl("take", "stop"))
        self.done(daemon.ctl("take", "start", "two"))
        self.done(daemon.ctl("take", "cancel"))

        retained = until(lambda: self.lines(what="retained", take="one"), "the end")[0]
        self.assertEqual(retained["who"], "127.0.0.1")
        self.assertTrue(pathlib.Path(retained["path"]).exists())
        self.assertGreater(int(retained["size_bytes"]), 0)
        discarded = until(lambda: self.lines(what="discarded", take="two"), "the end")[0]
        self.assertFalse(pathlib.Path(discarded["path"]).exists())

    def test_the_log_is_no_symbolic_link_and_health_says_so_once(self):
        precious = self.desk.write("precious", "text")
        self.log.symlink_to(precious)
        daemon = self.start()
        until(daemon.status, "an answer")

        self.done(daemon.ctl("subject", "reset", "actor"))

        fault = until(lambda: daemon.status().get("health", {}).get("audit", {}).get("error"), "a fault in health")
        self.assertIn("is a symbolic link", fault)
        self.done(daemon.ctl("subject", "reset", "actor"))
        self.assertEqual(daemon.program.output().count("is a symbolic link"), 1, daemon.program.output())
        self.assertEqual(precious.read_text(), "text")
        self.log.unlink()
        until(lambda: self.log.exists() and len(self.lines(order="subject reset")) == 2, "the entries that waited")
        until(lambda: not daemon.status()["health"]["audit"].get("error"), "health is good again")

    def test_a_full_disk_stops_neither_orders_nor_the_daemon_and_loses_no_entry(self):
        mount = f"mount -t tmpfs -o size=64k none {self.state}"
        tried = subprocess.run(["unshare", "--mount", "sh", "-c", mount], capture_output=True, text=True)
        if tried.returncode != 0:
            self.skipTest(f"no right to mount: {tried.stderr.strip()}")
        daemon = self.start()
        daemon.program.end()
        daemon.program = self.desk.start("/usr/bin/unshare", "--mount", "sh", "-c", f'{mount} && exec "$@"', "sh",
                                         BIN / "mocapd", "--config", daemon.config, "--state", self.state)
        until(daemon.status, "an answer")
        inside = pathlib.Path(f"/proc/{daemon.program.process.pid}/root{self.state}")
        self.log = inside / "audit.jsonl"
        filler = inside / "filler"
        filler.write_bytes(b"")
        with filler.open("ab", buffering=0) as file:
            try:
                while True:
                    file.write(b"x" * 512)
            except OSError:
                pass
        orders = 0
        while not (daemon.status().get("health") or {}).get("audit", {}).get("error"):
            self.done(daemon.ctl("subject", "reset", "actor"))
            orders += 1
            self.assertLess(orders, 200)

        self.done(daemon.ctl("subject", "reset", "actor"))
        self.assertIn("free space on the disk", daemon.status()["health"]["audit"]["error"])
        self.assertEqual(daemon.program.output().count("free space on the disk"), 1)
        filler.unlink()

        until(lambda: len(self.lines(what="ordered", order="subject reset")) == orders + 1, "the entries that waited")
        self.assertEqual(self.lines(what="lost"), [])

    def test_both_logs_of_an_order_from_the_page_name_the_same_person(self):
        self.make_keys(web="operator")
        daemon = self.start(more=KEYS)
        until(lambda: self.log.exists(), "the log")
        port = free_port()
        token = self.done(self.desk.run("mocap-web", "token", "web.tokens", "anna", "--role", "operator")).strip()
        web = self.desk.start("mocap-web", self.desk.endpoint, "--port", port, "--tokens", "web.tokens",
                              *self.keys("web"))

        def reset():
            asked = urllib.request.Request(f"http://127.0.0.1:{port}/api/v1/subject", method="POST",
                                           data=b'{"action":"ACTION_RESET","name":"actor"}',
                                           headers={"Content-Type": "application/json", "Authorization": f"Bearer {token}"})
            try:
                with urllib.request.urlopen(asked, timeout=LONG_S) as answer:
                    return answer.status == 200
            except OSError:
                return False

        until(reset, "the page's order")

        order = self.lines(what="ordered", order="subject reset")[-1]
        self.assertEqual((order["who"], order["states"], order["key"]), ("web", "anna", self.pair("web")["public"]))
        until(lambda: re.search(r"audit: who=anna role=operator .*method=subject", web.output()), "the page's own line")
        self.assertIn("states=anna", self.done(self.desk.run("mocapctl", "audit", "--file", self.log, "--who", "anna")))


if __name__ == "__main__":
    unittest.main()
