"""Fuzzes the decoders of the Python client with messages of a hostile feed: valid messages with bytes changed, removed, repeated
and joined. The client must take each message or count it as unreadable, and every frame that it returns is finite and matches its
description.

usage: python_fuzz.py [COUNT [SEED]]
"""

import json
import os
import pathlib
import random
import sys
import warnings

BUILD = pathlib.Path(os.environ.get("MOCAP_BUILD_DIR", "build/release")).resolve()
ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
sys.path[:0] = [str(ROOT / "tools/clients/python"), str(BUILD / "python")]

import numpy as np  # noqa: E402

import mocap.v1.control_pb2 as control_pb2  # noqa: E402
import mocap.v1.description_pb2 as description_pb2  # noqa: E402
import mocap.v1.event_pb2 as event_pb2  # noqa: E402
import mocap.v1.health_pb2 as health_pb2  # noqa: E402
import mocap.v1.snapshot_pb2 as snapshot_pb2  # noqa: E402
from mocap_client import Client, Control, ControlError, decode_lite  # noqa: E402

BONES, MARKERS = 3, 2


def description(draw):
    made = description_pb2.Description(protocol="mocap.v1", version=draw.choice([1, 1, 1, 2]), session_id=draw.choice("ab"))
    subject = made.subjects.add(name="actor")
    for i in range(BONES):
        bone = subject.bones.add(name=f"b{i}")
        bone.rest_offset_m.z = 0.1
        if i:
            bone.parent = draw.choice([i - 1] * 20 + [i, 200, 2**32 - 1])
    for i in range(MARKERS):
        subject.markers.add(name=f"m{i}")
    return made


def snapshot(draw):
    made = snapshot_pb2.Snapshot(description_version=draw.choice([1, 1, 1, 2]), number=draw.randrange(2**64), sequence=draw.randrange(99))
    made.instants.exposed_at_ns = draw.randrange(2**63)
    subject = made.subjects.add(subject=draw.choice([0, 0, 0, 7]), phase=2)
    count = draw.choice([0, BONES, BONES, BONES, BONES + 1])
    subject.bones.world_positions_m.extend([0.5] * 3 * count)
    subject.bones.world_rotations_xyzw.extend([0, 0, 0, draw.choice([1.0] * 8 + [float("nan"), 1e30])] * count)
    subject.bones.states.extend([2] * count)
    if draw.random() < 0.5:
        subject.bones.local_positions_m.extend([0.1] * 3 * draw.choice([count, 1]))
    subject.markers.positions_m.extend([1.0] * 3 * MARKERS)
    subject.markers.states.extend([2] * draw.choice([MARKERS] * 8 + [1]))
    made.unlabelled.positions_m.extend([1.0] * draw.choice([0, 3, 6, 5]))
    return made


def damaged(draw, payload):
    payload = bytearray(payload)
    for _ in range(draw.choice([0, 0, 1, 2, 4])):
        if not payload:
            break
        place = draw.randrange(len(payload))
        match draw.randrange(5):
            case 0:
                payload[place] = draw.randrange(256)
            case 1:
                payload[place] ^= 1 << draw.randrange(8)
            case 2:
                del payload[place:]
            case 3:
                payload[place:place] = payload[place:place + draw.randrange(40)]
            case _:
                payload[place:place] = bytes([0x80] * draw.randrange(30))
    return bytes(payload)


def check(frame):
    for subject in frame.subjects.values():
        bones, markers = subject.bones, subject.markers
        assert len(bones) in (0, len(bones.names)) and len(markers) in (0, len(markers.names))
        for column in (bones.positions, bones.rotations, bones.local_positions, bones.velocities, markers.positions):
            assert np.isfinite(column).all()
        assert all(parent < i for i, parent in enumerate(bones.parents))
    assert np.isfinite(frame.points.positions).all()


LITE = bytes.fromhex(json.loads((ROOT / "proto/lite/person.json").read_text())["hex"])


def check_lite(draw):
    try:
        lite = decode_lite(damaged(draw, LITE), draw.choice(["mocap", "unity"]))
    except ValueError:
        return
    assert len(lite.rotations) == len(lite.lost) <= 27 and lite.first_bone + len(lite.lost) <= lite.subject_bones
    assert np.isfinite(lite.root_position).all() and np.allclose((lite.rotations**2).sum(axis=-1), 1, atol=1e-5)


def take(client, control, draw):
    """Hands one message of each kind to the client. Returns whether it made a frame."""
    if client.description is None or draw.random() < 0.2:
        client._take_description(damaged(draw, description(draw).SerializeToString()))
    check_lite(draw)
    client._take_health(damaged(draw, health_pb2.Health().SerializeToString() + b"\n\0"))
    client._take_event(damaged(draw, event_pb2.Event(kind=draw.randrange(9), subject=draw.randrange(3)).SerializeToString()))
    payload = damaged(draw, snapshot(draw).SerializeToString())
    client._count(payload)
    control._exchange = lambda *_: damaged(draw, control_pb2.Answer(code=draw.randrange(9), message="m").SerializeToString())
    try:
        control.status()
    except ControlError:
        pass
    frame = client._hand_out(payload, client.description)
    if frame is not None:
        check(frame)
    return frame is not None


def main():
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 1000
    seed = int(sys.argv[2]) if len(sys.argv) > 2 else 1
    draw = random.Random(seed)
    warnings.simplefilter("ignore")  # of Protobuf, for data behind the end of a message
    with Client("tcp://127.0.0.1:1") as client, Control("tcp://127.0.0.1:1") as control:
        frames = sum(take(client, control, draw) for _ in range(count))
    print(f"{count} messages, {frames} frames, seed {seed}")
    return 0 if frames > 0 else 1


if __name__ == "__main__":
    sys.exit(main())
