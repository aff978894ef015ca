"""Prints the position of the first bone of each tracked subject, or why no data arrives. usage: example.py [ENDPOINT [SECONDS]]"""

import sys
import time

from mocap_client import Client

endpoint = sys.argv[1] if len(sys.argv) > 1 else "tcp://127.0.0.1:5570"
end = time.monotonic() + (float(sys.argv[2]) if len(sys.argv) > 2 else 10)
with Client(endpoint) as client:
    while time.monotonic() < end:
        frame = client.wait(1.0)
        if frame is None:
            print("no data:", client.diagnose()[1], flush=True)
            continue
        for name, subject in frame.subjects.items():
            if len(subject.bones):
                print(f"{frame.number}: {name}'s {subject.bones.names[0]} at {subject.bones.positions[0].round(3)}", flush=True)
    print(client.statistics())
