"""One snapshot as numpy arrays. The only file that depends on the schema (proto/mocap/v1/snapshot.proto)."""

import dataclasses
import difflib
import enum

import numpy as np


MAX_NUMBER = 1e9  # bound for positions, velocities and rotations


class Phase(enum.IntEnum):
    SEARCHING = 1
    TRACKING = 2
    LOST = 3


class State(enum.IntEnum):
    """State of a bone or a marker."""

    LOST = 1
    MEASURED = 2
    FILLED = 3


class Unreadable(Exception):
    """The message does not belong to this feed or is invalid."""


class UnknownName(LookupError, ValueError):
    """There is no such bone, marker or subject."""


class NotTracked(IndexError):
    """The subject is not tracked, so its bones or markers have no positions."""


def index_of(kind, name, owner, known):
    """The index of a name, or UnknownName with a suggestion and all names."""
    if name in known:
        return known.index(name)
    lowered = [one.lower() for one in known]
    near = difflib.get_close_matches(str(name).lower(), lowered, n=1, cutoff=0.6)
    advice = f", did you mean '{known[lowered.index(near[0])]}'?" if near else ""
    names = f"its {kind}s are {', '.join(known)}" if known else "it has none"
    raise UnknownName(f"{owner} has no {kind} '{name}'{advice}; {names}")


@dataclasses.dataclass
class Bones:
    """One row for each bone, in the order of `names`; no rows unless the subject is tracked. Single precision. In the axes and the length
    unit of the client (axes="unreal": cm, otherwise m)."""

    names: list
    parents: np.ndarray  # (n,) index of the parent; -1: the root
    states: np.ndarray  # (n,) State
    confidences: np.ndarray  # (n,) 0 to 1
    positions: np.ndarray  # (n, 3) positions of the joints in the world
    rotations: np.ndarray  # (n, 4) x y z w, from the bone's frame to the world
    local_positions: np.ndarray  # (n, 3) positions of the joints in the parent's frame
    local_rotations: np.ndarray  # (n, 4) x y z w, from the bone's frame to the parent's frame
    velocities: np.ndarray  # (n, 3) of the joints in the world, length unit per s; 0 if the feed omits them
    spins: np.ndarray  # (n, 3) angular velocities in the world, rad/s; 0 if the feed omits them

    def __len__(self):
        return len(self.positions)


@dataclasses.dataclass
class Bone:
    """One row of Bones. The arrays are views."""

    state: int
    confidence: float
    position: np.ndarray
    rotation: np.ndarray
    local_position: np.ndarray
    local_rotation: np.ndarray


@dataclasses.dataclass
class Marker:
    """One row of Markers. The position is a view."""

    state: int
    position: np.ndarray
    residual_px: float
    cameras: int
    confidence: float
    track: int


@dataclasses.dataclass
class Markers:
    names: list
    states: np.ndarray
    positions: np.ndarray
    residuals_px: np.ndarray
    cameras: np.ndarray
    confidences: np.ndarray
    tracks: np.ndarray  # id of the 3D track, plus 1; 0: none

    def __len__(self):
        return len(self.positions)


@dataclasses.dataclass
class Points:
    """Unlabelled markers."""

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
    residual_m: float  # nan: unknown
    smoothing_delay_s: float

    def bone(self, name):
        """Raises UnknownName, with the names that exist, for an unknown name, and NotTracked while there are no poses."""
        i = self._row("bone", self.bones, name)
        b = self.bones
        return Bone(int(b.states[i]), float(b.confidences[i]), b.positions[i], b.rotations[i], b.local_positions[i], b.local_rotations[i])

    def marker(self, name):
        """Raises as bone()."""
        i = self._row("marker", self.markers, name)
        m = self.markers
        return Marker(int(m.states[i]), m.positions[i], float(m.residuals_px[i]), int(m.cameras[i]), float(m.confidences[i]), int(m.tracks[i]))

    def _row(self, kind, rows, name):
        i = index_of(kind, name, f"'{self.name}'", rows.names)
        if not len(rows):
            raise NotTracked(f"'{self.name}' is {self.phase.name.lower()}: its {kind}s have no positions now; check len(subject.{kind}s)")
        return i


@dataclasses.dataclass
class Frame:
    number: int
    sequence: int
    description_version: int
    session: str
    cameras: int
    expected_cameras: int
    exposed_at_ns: int  # None: unknown
    sent_at_ns: int  # None: unknown
    utc_minus_host_ns: int  # None: unknown
    same_clock: bool  # daemon and client run on the same host
    subjects: dict  # by name
    points: Points

    def subject(self, name):
        """Raises UnknownName, with the names that exist, for an unknown name."""
        index_of("subject", name, "the frame", list(self.subjects))
        return self.subjects[name]


def _floats(column, width):
    array = np.fromiter(column, np.float32, len(column))
    if len(array) % width or not (np.abs(array) <= MAX_NUMBER).all():  # the comparison is also false for NaN
        raise Unreadable("a column with an incomplete vector, or a number that is out of range")
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


def _parents(known):
    parents = np.array([bone.parent if bone.HasField("parent") else -1 for bone in known.bones], np.int64)
    if (parents >= np.arange(len(parents))).any():
        raise Unreadable("a bone whose parent is not before it")
    return parents.astype(np.int32)


def _bones(message, known, axes):
    positions = _floats(message.world_positions_m, 3)
    n = len(positions)
    rotations = _floats(message.world_rotations_xyzw, 4)
    parents = _parents(known)
    if n not in (0, len(parents)):
        raise Unreadable("bones that differ from the description")
    _same_length(positions, rotations)
    parents = parents[:n]
    roots = parents < 0
    if message.local_positions_m:
        local_positions = _floats(message.local_positions_m, 3)
    else:  # omitted if each local position is the rest offset
        rest = _floats([number for b in known.bones for number in (b.rest_offset_m.x, b.rest_offset_m.y, b.rest_offset_m.z)], 3)[:n]
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
        raise Unreadable("markers that differ from the description")
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
        raise Unreadable("a subject without a description")
    known = description.subjects[message.subject]
    phase = Phase(message.phase) if message.phase in (2, 3) else Phase.SEARCHING
    return Subject(known.name, phase, _bones(message.bones, known, axes), _markers(message.markers, known, axes),
                   message.residual_m if message.HasField("residual_m") else float("nan"), message.smoothing_delay_s)


def frame_of(message, description, axes, same_clock):
    """Converts a message. Raises Unreadable if message and description do not match."""
    subjects = [_subject(subject, description, axes) for subject in message.subjects]
    instants = message.instants
    return Frame(
        number=message.number, sequence=message.sequence, description_version=message.description_version,
        session=description.session_id, cameras=len(message.views.cameras), expected_cameras=message.expected_views,
        exposed_at_ns=instants.exposed_at_ns if message.HasField("instants") else None,
        sent_at_ns=instants.sent_at_ns if instants.HasField("sent_at_ns") else None,
        utc_minus_host_ns=message.utc_minus_host_ns if message.HasField("utc_minus_host_ns") else None,
        same_clock=same_clock, subjects={subject.name: subject for subject in subjects}, points=_points(message.unlabelled, axes))
