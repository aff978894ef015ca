"""Converts from the axes of the feed (right-handed, x forward, y left, z up, m) to the axes of an engine."""

import dataclasses

import numpy as np


@dataclasses.dataclass(frozen=True)
class Axes:
    """Engine axis i is sign[i] times feed axis source[i]. sense is -1 if the conversion is a reflection."""

    source: tuple
    sign: tuple
    unit: float
    sense: int

    def place(self, vectors):
        """Converts positions and velocities, one in each row."""
        return vectors[..., self.source] * np.float32(self.unit) * np.asarray(self.sign, np.float32)

    def spin(self, vectors):
        """Converts angular velocities, rad/s."""
        return vectors[..., self.source] * np.float32(self.sense) * np.asarray(self.sign, np.float32)

    def turn(self, quaternions):
        """Converts rotations, x y z w. A reflection reverses the sense of rotation."""
        return np.concatenate([self.spin(quaternions[..., :3]), quaternions[..., 3:]], axis=-1)


AXES = {
    "mocap": Axes((0, 1, 2), (1, 1, 1), 1.0, 1),  # forward, left, up
    "unity": Axes((1, 2, 0), (-1, 1, 1), 1.0, -1),  # right, up, forward
    "unreal": Axes((0, 1, 2), (1, -1, 1), 100.0, -1),  # forward, right, up, cm
    "godot": Axes((1, 2, 0), (-1, 1, -1), 1.0, 1),  # right, up, backward
    "gltf": Axes((1, 2, 0), (1, 1, 1), 1.0, 1),  # left, up, forward
}
