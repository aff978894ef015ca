"""Runs the Python client for the tests; arguments and output as probe.c."""

import json
import math
import sys
import time

from mocap_client import AXES, Client

endpoint, axes, rate_hz, seconds, *keys = sys.argv[1:]
keys = dict(zip(("server_key", "public_key", "secret_key"), keys))
said = {"frames": 0}
frame = None
with Client(endpoint, axes=list(AXES)[int(axes)], **keys) as client:
    begin = time.monotonic()
    at = begin
    while at < begin + float(seconds):
        time.sleep(max(0.0, at - time.monotonic()))
        newer = client.poll()
        if newer is not None:
            frame = newer
            said["frames"] += 1
        at += 1 / float(rate_hz)
    diagnosis, said["sentence"] = client.diagnose()
    said["diagnosis"] = int(diagnosis)
    statistics = client.statistics()
    for name in ("received", "lost", "restarts", "unreadable", "rate_hz", "age_p50_ms", "age_p99_ms"):
        value = getattr(statistics, name)
        if not math.isnan(value):
            said[name] = value
if frame is not None:
    said.update(number=frame.number, version=frame.description_version, session=frame.session)
    said["subjects"] = []
    for subject in frame.subjects.values():
        shown = {"name": subject.name, "bone": subject.bones.names[0]}
        if len(subject.bones):
            bone = subject.bone(shown["bone"])
            columns = {"position": bone.position, "rotation_xyzw": bone.rotation, "local_position": bone.local_position,
                       "local_rotation_xyzw": bone.local_rotation, "velocity": subject.bones.velocities[0],
                       "spin": subject.bones.spins[0]}
            shown.update({name: [float(v) for v in values] for name, values in columns.items()})
        said["subjects"].append(shown)
print(json.dumps(said))
