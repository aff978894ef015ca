"""A feed with arbitrary content, faults included: real sockets and real messages, no daemon."""

import os
import sys
import threading
import time

import zmq
import zmq.auth

from harness import BIN, free_port

sys.path.insert(0, str(BIN.parent / "python"))

import mocap.v1.description_pb2 as description_pb2  # noqa: E402
import mocap.v1.health_pb2 as health_pb2  # noqa: E402
import mocap.v1.snapshot_pb2 as snapshot_pb2  # noqa: E402

STREAMING, SILENT, STOPPED = 2, 3, 6
SEARCHING, TRACKING = 1, 2
LOST = 1  # of a bone
STANDING = {"position": [0.0, 0.0, 1.0], "rotation_xyzw": [0.0, 0.0, 0.0, 1.0]}


def chain(bone):
    """The bones of one subject: a name, or the names of a chain of bones, root first."""
    return (bone,) if isinstance(bone, str) else bone


def description(protocol="mocap.v1", version=1, session="session", bones=("Hips",)):
    """One subject for each entry of `bones` (see chain). A prop's bone is called "Body" and has no name in engines."""
    said = description_pb2.Description(protocol=protocol, version=version, producer="fake 1", session_id=session, nominal_rate_hz=100)
    for i, bone in enumerate(bones):
        subject = said.subjects.add(name=f"actor{i}" if i else "actor", marker_set="one", skeleton="one")
        for index, name in enumerate(chain(bone)):
            added = subject.bones.add(name=name)
            if index > 0:
                added.parent = index - 1
                added.unity_name = name
                added.rest_offset_m.z = 0.25
            elif name != "Body":
                added.unity_name, added.unreal_name, added.vrm_name = "Hips", "pelvis", "hips"
        subject.markers.add(name="M", bone=0)
    return said


def snapshot(number, sequence, version=1, phase=TRACKING, poses=(STANDING,), bones=(), points=(), lost=()):
    """Returns a snapshot with one subject for each pose; the pose is that of its root. `points` are unlabelled markers, `lost` are
    bones, each (subject, bone)."""
    said = snapshot_pb2.Snapshot(number=number, sequence=sequence, description_version=version, expected_views=4)
    said.views.cameras.extend(range(4))
    for i, pose in enumerate(poses):
        add_subject(said.subjects.add(subject=i, phase=phase), phase, pose, len(chain(bones[i])) - 1 if i < len(bones) else 0)
    for subject, bone in lost:
        lose(said.subjects[subject].bones, bone)
    for track, point in enumerate(points, 1):
        said.unlabelled.track_ids_plus_one.append(track)
        said.unlabelled.positions_m.extend(point)
        said.unlabelled.cameras.append(2)
        said.unlabelled.residuals_millipx.append(50)
    return said


def lose(bones, bone):
    """The pose of a lost bone has no meaning."""
    bones.states[bone] = LOST
    bones.world_positions_m[3 * bone:3 * bone + 3] = (9.0, 9.0, 9.0)
    for rotations in (bones.world_rotations_xyzw, bones.local_rotations_xyzw):
        rotations[4 * bone:4 * bone + 4] = (0.0, 0.0, 1.0, 0.0)


def add_subject(subject, phase, pose, children=0):
    subject.markers.states.append(2)
    subject.markers.positions_m.extend(pose["position"])
    subject.markers.cameras.append(3)
    subject.markers.confidences_percent.append(99)
    subject.markers.track_ids_plus_one.append(5)
    subject.markers.residuals_millipx.append(50)
    if phase == TRACKING:
        bones = subject.bones
        bones.states.append(2)
        bones.confidences_percent.append(98)
        bones.world_positions_m.extend(pose["position"])
        bones.world_rotations_xyzw.extend(pose["rotation_xyzw"])
        bones.local_rotations_xyzw.extend(pose["rotation_xyzw"])
        if "velocity" in pose:
            bones.velocities_m_s.extend(pose["velocity"])
            bones.spins_rad_s.extend(pose["spin"])
        for _ in range(children):  # at the root, not rotated against it
            bones.states.append(2)
            bones.confidences_percent.append(98)
            bones.world_positions_m.extend(pose["position"])
            bones.world_rotations_xyzw.extend(pose["rotation_xyzw"])
            bones.local_rotations_xyzw.extend((0.0, 0.0, 0.0, 1.0))
            if "velocity" in pose:
                bones.velocities_m_s.extend(pose["velocity"])
                bones.spins_rad_s.extend(pose["spin"])


# Fields 3001 (bytes) and 3002 (varint), which the schema does not have.
UNKNOWN = b"\xca\xbb\x01\x03new" + b"\xd0\xbb\x01\x07"


class FakeFeed:
    """Sends messages in a thread until closed. The attributes may be changed while it runs."""

    def __init__(self, port=None, rate_hz=100, keys=None, allowed=None, protocol="mocap.v1", version=1, session="session", bones=("Hips",),
                 phase=TRACKING, poses=(STANDING,), cameras=None, describes=True, utc_error_ns=0,
                 later_revision=False, points=(), timecode=None, lost=()):
        self.port = port or free_port()
        self.endpoint = f"tcp://127.0.0.1:{self.port}"
        self.rate_hz, self.protocol, self.version, self.session, self.bones = rate_hz, protocol, version, session, bones
        self.phase, self.poses, self.describes, self.utc_error_ns = phase, poses, describes, utc_error_ns
        self.points, self.timecode, self.lost = points, timecode, lost
        self._more = UNKNOWN if later_revision else b""
        self.cameras = cameras if cameras is not None else {"north": STREAMING}
        self.sent = 0
        self._keys, self._allowed = keys, allowed
        self._stop = threading.Event()
        self._ready = threading.Event()
        self._thread = threading.Thread(target=self._run)
        self._thread.start()
        self._ready.wait()

    def close(self):
        self._stop.set()
        self._thread.join()

    def _utc_minus_host(self):
        return time.time_ns() - time.monotonic_ns() + self.utc_error_ns

    def _description(self, version):
        said = description(self.protocol, version, self.session, self.bones)
        if self._more:
            said.protocol_revision = 99
        return b"description\0" + said.SerializeToString() + self._more

    def _health(self):
        said = health_pb2.Health(at_ns=time.monotonic_ns(), utc_minus_host_ns=self._utc_minus_host())
        for name, phase in self.cameras.items():
            said.cameras.add(name=name, phase=phase)
        return b"health\0" + said.SerializeToString() + self._more

    def _answer_zap(self, zap):
        while zap.poll(0):
            version, request, _domain, _address, _identity, _mechanism, key = zap.recv_multipart()
            known = zmq.utils.z85.encode(key) in self._allowed
            zap.send_multipart([version, request, b"200" if known else b"400", b"OK" if known else b"unknown key", b"", b""])

    def _run(self):
        context = zmq.Context()
        zap = context.socket(zmq.REP)
        zap.bind("inproc://zeromq.zap.01")
        socket = context.socket(zmq.XPUB)
        # A long send queue: after a pause, this thread sends all overdue messages at once. The feed must not lose them,
        # so that every lost message is the client's fault.
        for option, value in ((zmq.LINGER, 0), (zmq.SNDHWM, 1000)):
            socket.setsockopt(option, value)
        if self._keys is not None:
            socket.curve_server, socket.curve_secretkey, socket.zap_domain = True, self._keys[1], b"test"
        said_version = self.version
        if self.describes:
            socket.setsockopt(zmq.XPUB_WELCOME_MSG, self._description(said_version))
        socket.bind(self.endpoint)
        self._ready.set()
        sequence = 0
        next_at = time.monotonic()
        next_report = next_at
        while not self._stop.is_set():
            if self._allowed is not None:
                self._answer_zap(zap)
            while socket.poll(0):
                socket.recv()
            version = self.version
            if time.monotonic() >= next_report or said_version != version:
                next_report = time.monotonic() + 1
                if self.describes:
                    socket.setsockopt(zmq.XPUB_WELCOME_MSG, self._description(version))
                    socket.send(self._description(version))
                said_version = version
                socket.send(self._health())
            if self.rate_hz > 0:
                said = snapshot(sequence + 1, sequence, version, self.phase, self.poses, self.bones, self.points, self.lost)
                if self.timecode is not None:
                    said.timecode.CopyFrom(snapshot_pb2.Timecode(**self.timecode))
                said.utc_minus_host_ns = self._utc_minus_host()
                now = time.monotonic_ns()
                instants = said.instants
                instants.exposed_at_ns = instants.received_at_ns = instants.detected_at_ns = instants.fused_at_ns = now
                instants.sent_at_ns = now
                socket.send(b"snapshot\0" + said.SerializeToString() + self._more)
                sequence += 1
                self.sent = sequence
            next_at = max(next_at + 1 / (self.rate_hz or 100), time.monotonic() - 0.1)
            time.sleep(max(0.0, next_at - time.monotonic()))
        context.destroy(linger=0)
