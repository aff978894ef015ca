"""Runs the Python client's control, health and events for the tests; arguments, commands and output as control_probe.c."""

import json
import sys

from mocap_client import Client, Control, ControlError, UnknownName

endpoint, feed, server_key, secret_key = (None if word == "-" else word for word in sys.argv[1:5])
keys = {"server_key": server_key, "secret_key": secret_key}


def cameras(health):
    return [{"name": camera.name, "phase": camera.phase, "frames": camera.frames} for camera in health.cameras] if health else []


def rows(numbers):
    values = [float(one) for one in numbers.split(",")]
    return [values[i:i + 3] for i in range(0, len(values), 3)]


def status(control):
    found = control.status()
    subjects = [{"name": one.name, "phase": one.phase, "away": int(one.away)} for one in found.subjects]
    return {"capturing": int(found.capturing), "role": found.role, "subjects": subjects, "cameras": cameras(found.health)}


def optional(word):
    return None if word == "-" else float(word)


REQUESTS = {
    "status": status,
    "start": lambda control: {"message": control.start_capture()},
    "stop": lambda control: {"message": control.stop_capture()},
    "add": lambda control, name, marker_set=None: {"message": control.add_subject(name, marker_set)},
    "remove": lambda control, name: {"message": control.remove_subject(name)},
    "reset": lambda control, name: {"message": control.reset_subject(name)},
    "fit": lambda control, name, rest, markers: {"message": control.fit_subject(name, rows(rest), rows(markers), 0.001)},
    "camera": lambda control, name, exposure, gain: {"message": control.set_camera(name, optional(exposure), optional(gain))},
    "mask": lambda control, name, images: {"message": control.learn_mask(None if name == "-" else name, int(images), timeout_s=60)},
    "reload": lambda control: {"message": control.reload()},
    "take-start": lambda control, name, notes="": {"message": control.start_take(name, notes=notes)},
    "take-stop": lambda control: {"message": control.stop_take(timeout_s=60)},
    "take-cancel": lambda control: {"message": control.cancel_take()},
    "take-mark": lambda control, name, text: {"message": control.mark_take(text)},
    "take-next": lambda control: {"message": control.next_take(timeout_s=60)},
    "frame": lambda control: {"bones": len(next(iter(control.snapshot().subjects.values())).bones.names)},
}


def find(client, what, name):
    subject = next(iter(client.wait(10).subjects.values()))
    try:
        getattr(subject, what)(name)
        return {"index": getattr(subject, what + "s").names.index(name), "fault": ""}
    except UnknownName as fault:
        return {"index": -1, "fault": str(fault)}


def run(client, control, what, *arguments):
    if what == "health":
        health = client.health
        return {"sets": health.sets if health else 0, "cameras": cameras(health)}
    if what == "events":
        return {"events": [{"kind": int(event.kind), "name": event.name} for event in client.events()]}
    if what in ("bone", "marker"):
        return find(client, what, *arguments)
    try:
        return {"code": 1, "diagnosis": 0, **REQUESTS[what](control, *arguments)}
    except ControlError as fault:
        return {"code": int(fault.code), "diagnosis": int(fault.diagnosis), "message": str(fault)}


with Control(endpoint, **keys) as operator, Client(feed, **keys) as subscriber:
    for line in sys.stdin:
        print(json.dumps(run(subscriber, operator, *line.split())), flush=True)
