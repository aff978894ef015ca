"""What the README prints runs as printed. In a network of its own (tools/own_network.sh), where the feed's port is
free."""

import ast
import os
import re
import subprocess
import threading
import unittest

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
    return re.search(r"^```python\n(.*?)^```", (SOURCE / "README.md").read_text(), re.MULTILINE | re.DOTALL).group(1)


class Readme(unittest.TestCase):
    def setUp(self):
        self.desk = Desk()
        self.addCleanup(self.desk.close)

    def start_daemon(self):
        text = CONFIG.format(source=SOURCE) + "".join(CAMERA.format(number=n, source=SOURCE) for n in range(1, 5))
        return self.desk.start("mocapd", "--config", self.desk.write("mocapd.toml", text))

    def test_the_subscriber_is_ten_lines_and_the_one_that_is_shipped(self):
        code = first_python_block()

        self.assertEqual(len(code.splitlines()), 10)
        self.assertEqual(code, (SOURCE / "tools/clients/python/subscribe.py").read_text())

    def test_the_subscriber_prints_where_the_named_markers_are(self):
        daemon = self.start_daemon()
        subscriber = subprocess.Popen(
            ["/usr/bin/python3", "-c", first_python_block()], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
            env={**os.environ, "PYTHONPATH": str(BIN.parent / "python")}, cwd=self.desk.folder)
        limit = threading.Timer(40, subscriber.kill)  # then its output ends, and the test fails
        limit.start()
        self.addCleanup(limit.cancel)
        self.addCleanup(subscriber.communicate)
        self.addCleanup(subscriber.kill)

        whole = next((seen for seen in map(ast.literal_eval, subscriber.stdout) if len(seen) == 18), None)

        if whole is None:
            subscriber.kill()
            self.fail(subscriber.stderr.read() + daemon.said())
        heights = {name: place[2] for name, place in whole.items()}
        self.assertGreater(heights["Head"], heights["Hips"])
        self.assertGreater(heights["Hips"], heights["LeftFoot"])


if __name__ == "__main__":
    unittest.main(verbosity=2)
