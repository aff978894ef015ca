"""One snapshot as numpy arrays. The only file that knows the schema (proto/mocap/v1/snapshot.proto)."""

import dataclasses
import enum

import numpy as np


MAX_NUMBER = 1e9  # no place, speed or turn is larger


class Phase(enum.IntEnum):
    SEARCHING = 1
    TRACKING = 2
    LOST = 3


class State(enum.IntEnum):
    """Of a bone or a marker."""

    LOST = 1
    MEASURED = 2
    FILLED = 3


class Unreadable(Exception):
    """A message that is none of this feed."""


@dataclasses.dataclass
class Bones:
    """One row a bone, in the order of `names`; no rows unless the subject is tracked. Single precision."""

    names: list
    parents: np.ndarray  # -1: the root
    states: np.ndarray
    confidences: np.ndarray  # 0 to 1
    positions: np.ndarray  # (n, 3) of the joints, in the world
    rotations: np.ndarray  # (n, 4) x y z w
    local_positions: np.ndarray  # in the parent's frame
    local_rotations: np.ndarray
    velocities: np.ndarray  # 0 where the feed does not tell
    spins: np.ndarray

    def __len__(self):
        return len(self.positions)


@dataclasses.dataclass
class Bone:
    """One row; the arrays are views."""

    state: int
    confidence: float
    position: np.ndarray
    rotation: np.ndarray
    local_position: np.ndarray
    local_rotation: np.ndarray


@dataclasses.dataclass
class Markers:
    names: list
    states: np.ndarray
    positions: np.ndarray
    residuals_px: np.ndarray
    cameras: np.ndarray
    confidences: np.ndarray
    tracks: np.ndarray  # plus 1; 0: none

    def __len__(self):
        return len(self.positions)


@dataclasses.dataclass
class Points:
    """Markers without a name."""

    positions: np.ndarray
    residuals_px: np.ndarray
    cameras: np.ndarray
    tracks: np.ndarray

    def __len__(self):
        return len(self.positions)


@dataclasses.dataclass
class Subject:
    name: str
    phase: Phase
    bones: Bones
    markers: Markers
    residual_m: float  # nan: not known
    smoothing_delay_s: float

    def bone(self, name):
        i = self.bones.names.index(name)
        b = self.bones
        return Bone(int(b.states[i]), float(b.confidences[i]), b.positions[i], b.rotations[i], b.local_positions[i], b.local_rotations[i])


@dataclasses.dataclass
class Frame:
    number: int
    sequence: int
    description_version: int
    session: str
    cameras: int
    expected_cameras: int
    exposed_at_ns: int
    sent_at_ns: int  # None: not known
    utc_minus_host_ns: int  # None: not known
    same_clock: bool  # the daemon's host is this one
    subjects: dict  # by name
    points: Points


def _floats(column, width):
    array = np.fromiter(column, np.float32, len(column))
    if len(array) % width or not (np.abs(array) <= MAX_NUMBER).all():  # which also holds for none that is not finite
        raise Unreadable("a column that ends within a vector, or a number beyond all bounds")
    return array.reshape(-1, width)


def _wholes(column, count):
    if not column:
        return np.zeros(count, np.uint32)
    return np.fromiter(column, np.uint32, len(column))


def _same_length(*columns):
    if len({len(column) for column in columns}) > 1:
        raise Unreadable("columns differ in length")


def _product(a, b):
    ax, ay, az, aw = np.moveaxis(a, -1, 0)
    bx, by, bz, bw = np.moveaxis(b, -1, 0)
    return np.stack([aw * bx + ax * bw + ay * bz - az * by, aw * by - ax * bz + ay * bw + az * bx,
                     aw * bz + ax * by - ay * bx + az * bw, aw * bw - ax * bx - ay * by - az * bz], axis=-1)


def _vectors(column, like):
    return _floats(column, 3) if column else np.zeros_like(like)


def _bones(message, known, axes):
    positions = _floats(message.world_positions_m, 3)
    n = len(positions)
    rotations = _floats(message.world_rotations_xyzw, 4)
    parents = np.array([bone.parent if bone.HasField("parent") else -1 for bone in known.bones], np.int32)
    if n not in (0, len(parents)):
        raise Unreadable("bones that are not described")
    parents = parents[:n]
    roots = parents < 0
    if message.local_positions_m:
        local_positions = _floats(message.local_positions_m, 3)
    else:  # left out where each bone's is its rest offset
        rest = np.array([(b.rest_offset_m.x, b.rest_offset_m.y, b.rest_offset_m.z) for b in known.bones], np.float32)[:n].reshape(-1, 3)
        local_positions = np.where(roots[:, None], positions, rest)
    if message.local_rotations_xyzw:
        local_rotations = _floats(message.local_rotations_xyzw, 4)
    else:
        back = rotations[parents] * np.array([-1, -1, -1, 1], np.float32)
        local_rotations = np.where(roots[:, None], rotations, _product(back, rotations))
    velocities = _vectors(message.velocities_m_s, positions)
    spins = _vectors(message.spins_rad_s, positions)
    states = _wholes(message.states, n)
    confidences = _wholes(message.confidences_percent, n) / np.float32(100)
    _same_length(positions, rotations, local_positions, local_rotations, velocities, spins, states, confidences)
    return Bones([bone.name for bone in known.bones], parents, states, confidences, axes.place(positions),
                 axes.turn(rotations), axes.place(local_positions), axes.turn(local_rotations), axes.place(velocities),
                 axes.spin(spins))


def _markers(message, known, axes):
    positions = _floats(message.positions_m, 3)
    n = len(positions)
    if n not in (0, len(known.markers)):
        raise Unreadable("markers that are not described")
    columns = [_wholes(column, n) for column in (message.states, message.cameras, message.confidences_percent,
                                                 message.track_ids_plus_one, message.residuals_millipx)]
    _same_length(positions, *columns)
    states, cameras, confidences, tracks, residuals = columns
    return Markers([marker.name for marker in known.markers], states, axes.place(positions), residuals / np.float32(1000),
                   cameras, confidences / np.float32(100), tracks)


def _points(message, axes):
    positions = _floats(message.positions_m, 3)
    columns = [_wholes(column, len(positions)) for column in (message.residuals_millipx, message.cameras, message.track_ids_plus_one)]
    _same_length(positions, *columns)
    return Points(axes.place(positions), columns[0] / np.float32(1000), columns[1], columns[2])


def _subject(message, description, axes):
    if message.subject >= len(description.subjects):
        raise Unreadable("a subject that is not described")
    known = description.subjects[message.subject]
    phase = Phase(message.phase) if message.phase in (2, 3) else Phase.SEARCHING
    return Subject(known.name, phase, _bones(message.bones, known, axes), _markers(message.markers, known, axes),
                   message.residual_m if message.HasField("residual_m") else float("nan"), message.smoothing_delay_s)


def frame_of(message, description, axes, same_clock):
    """Raises Unreadable where message and description do not fit."""
    subjects = [_subject(subject, description, axes) for subject in message.subjects]
    instants = message.instants
    return Frame(
        number=message.number, sequence=message.sequence, description_version=message.description_version,
        session=description.session_id, cameras=len(message.views.cameras), expected_cameras=message.expected_views,
        exposed_at_ns=instants.exposed_at_ns, sent_at_ns=instants.sent_at_ns if instants.HasField("sent_at_ns") else None,
        utc_minus_host_ns=message.utc_minus_host_ns if message.HasField("utc_minus_host_ns") else None,
        same_clock=same_clock, subjects={subject.name: subject for subject in subjects}, points=_points(message.unlabelled, axes))
