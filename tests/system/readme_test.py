"""The examples in the README run as printed; tests/system/first_hour.sh runs its commands. Runs in its own network namespace
(tools/own_network.sh), in which the feed's port is free."""

import ast
import os
import subprocess
import threading
import unittest

import readme
from harness import BIN, SOURCE, Desk

CONFIG = """
[capture]
rig = "{source}/config/demo.rig.toml"

[[subject]]
name = "actor"
marker_set = "{source}/config/markersets/openmocap18.toml"
"""

CAMERA = """
[[camera]]
name = "cam{number}"
driver = "synthetic"
rate_hz = 30
marker_set = "{source}/config/markersets/openmocap18.toml"
"""


def first_python_block():
    return readme.block((SOURCE / "README.md").read_text(), "python")


class Readme(unittest.TestCase):
    def setUp(self):
        self.desk = Desk()
        self.addCleanup(self.desk.close)

    def start_daemon(self):
        text = CONFIG.format(source=SOURCE) + "".join(CAMERA.format(number=n, source=SOURCE) for n in range(1, 5))
        return self.desk.start("mocapd", "--config", self.desk.write("mocapd.toml", text))

    def test_the_subscriber_in_the_readme_is_the_shipped_one_and_has_ten_lines(self):
        code = first_python_block()

        self.assertEqual(len(code.splitlines()), 10)
        self.assertEqual(code, (SOURCE / "tools/clients/python/subscribe.py").read_text())

    def test_commands_are_the_lines_of_plain_blocks_and_command_lines_in_the_text(self):
        text = """
Run `mocapctl cameras list`, not `mocapd` or `tools/clients`; `systemctl
status`, `tools/build.sh` and again `mocapctl cameras list`.

   ```
   sudo one && two   # why
   # nothing
   three \\
     four &   # five
   ```

```text
output
```
"""
        found = readme.commands(text)

        self.assertEqual(found, ["mocapctl cameras list", "systemctl status", "tools/build.sh", "sudo one && two",
                                 "three four &"])

    def test_the_subscriber_prints_the_positions_of_labelled_markers(self):
        daemon = self.start_daemon()
        subscriber = subprocess.Popen(
            ["/usr/bin/python3", "-c", first_python_block()], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
            env={**os.environ, "PYTHONPATH": str(BIN.parent / "python")}, cwd=self.desk.folder)
        limit = threading.Timer(40, subscriber.kill)  # its output then ends, and the test fails
        limit.start()
        self.addCleanup(limit.cancel)
        self.addCleanup(subscriber.communicate)
        self.addCleanup(subscriber.kill)

        whole = next((seen for seen in map(ast.literal_eval, subscriber.stdout) if len(seen) == 18), None)

        if whole is None:
            subscriber.kill()
            self.fail(subscriber.stderr.read() + daemon.output())
        heights = {name: place[2] for name, place in whole.items()}
        self.assertGreater(heights["Head"], heights["Hips"])
        self.assertGreater(heights["Hips"], heights["LeftFoot"])


if __name__ == "__main__":
    unittest.main(verbosity=2)
