"""From the feed's axes (right-handed, x forward, y left, z up, m) to an engine's."""

import dataclasses

import numpy as np


@dataclasses.dataclass(frozen=True)
class Axes:
    """New axis i is sign[i] times the feed's axis source[i]; sense is -1 where that mirrors."""

    source: tuple
    sign: tuple
    unit: float
    sense: int

    def place(self, vectors):
        """Of positions and velocities, one a row."""
        return vectors[..., self.source] * np.float32(self.unit) * np.asarray(self.sign, np.float32)

    def spin(self, vectors):
        """Of turns about axes, rad/s."""
        return vectors[..., self.source] * np.float32(self.sense) * np.asarray(self.sign, np.float32)

    def turn(self, quaternions):
        """Of rotations, x y z w: the axis moves along, and a mirror turns its sense round."""
        return np.concatenate([self.spin(quaternions[..., :3]), quaternions[..., 3:]], axis=-1)


AXES = {
    "mocap": Axes((0, 1, 2), (1, 1, 1), 1.0, 1),  # forward, left, up
    "unity": Axes((1, 2, 0), (-1, 1, 1), 1.0, -1),  # right, up, forward
    "unreal": Axes((0, 1, 2), (1, -1, 1), 100.0, -1),  # forward, right, up, cm
    "godot": Axes((1, 2, 0), (-1, 1, -1), 1.0, 1),  # right, up, backward
    "gltf": Axes((1, 2, 0), (1, 1, 1), 1.0, 1),  # left, up, forward
}
