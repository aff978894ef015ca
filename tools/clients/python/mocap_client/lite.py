"""The messages of the topics lite/NAME. proto/lite/README.md has the layout and the precision."""

import dataclasses
import struct

import numpy as np

from .axes import AXES
from .frame import Phase

_HEAD = struct.Struct("<BBBBIIQq")
_HEADER, _ROTATION, _MOST_BONES = 37, 6, 27
_PHASE, _OUT_OF_RANGE, _OFF_REST = 3, 4, 8
_STEPS = 16383 * 2**0.5


@dataclasses.dataclass(frozen=True)
class Lite:
    """A subject at one instant, or the bones of it from first_bone on."""

    number: int
    sequence: int
    description_version: int
    exposed_at_utc_ns: int
    phase: Phase
    subject_bones: int  # 0: no pose
    first_bone: int
    out_of_range: bool  # the root is more than 838 m from the origin: its position is not right
    off_rest: bool  # a joint is not at its rest offset from its parent
    root_position: np.ndarray
    rotations: np.ndarray  # (bones, 4): x y z w, world from bone
    lost: np.ndarray  # (bones,): the bone has no pose


def decode_lite(payload, axes="mocap"):
    """The message in these bytes, which follow the zero byte of the topic, or come from NATS. ValueError if they are none."""
    payload = bytes(payload)
    bones, rest = divmod(len(payload) - _HEADER, _ROTATION)
    if not (0 <= bones <= _MOST_BONES and rest == 0 and payload[0] == 1 and payload[3] + bones <= payload[2]):
        raise ValueError(f"{len(payload)} bytes that are no message of a topic lite/NAME")
    _, flags, subject_bones, first, version, sequence, number, exposed = _HEAD.unpack_from(payload)
    root = [int.from_bytes(payload[at:at + 3], "little", signed=True) * 1e-4 for at in (28, 31, 34)]
    rotations, lost = _rotations(np.frombuffer(payload, np.uint8, offset=_HEADER).reshape(bones, _ROTATION))
    change = AXES[axes]
    phase = flags & _PHASE
    return Lite(number, sequence, version, exposed, Phase(phase) if phase > 1 else Phase.SEARCHING, subject_bones, first,
                bool(flags & _OUT_OF_RANGE), bool(flags & _OFF_REST), change.place(np.array(root, np.float32)), change.turn(rotations), lost)


def _rotations(packed):
    """Smallest three: 15 bits for each of three components, 2 bits for the index of the largest, 1 bit: lost."""
    words = np.zeros((len(packed), 8), np.uint8)
    words[:, :_ROTATION] = packed
    words = words.view("<u8")[:, 0]
    lost = (words >> np.uint64(47)) != 0
    largest = (words >> np.uint64(45) & np.uint64(3)).astype(int)
    small = np.stack([(words >> np.uint64(15 * i) & np.uint64(0x7FFF)).astype(float) - 16384 for i in range(3)], axis=-1) / _STEPS
    squares = (small**2).sum(axis=-1, keepdims=True)
    small /= np.sqrt(np.maximum(squares, 1.0))  # an encoder writes none above 1
    rotations = np.zeros((len(packed), 4))
    rows = np.arange(len(packed))
    rotations[rows, largest] = np.sqrt(np.maximum(0.0, 1.0 - squares[:, 0]))
    places = np.array([[1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2]])[largest]
    rotations[rows[:, None], places] = small
    rotations[lost] = (0.0, 0.0, 0.0, 1.0)
    return rotations.astype(np.float32), lost
