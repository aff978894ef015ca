"""The feed of a mocapd as numpy arrays.

    from mocap_client import Client

    with Client("tcp://127.0.0.1:5570", axes="unity") as client:
        frame = client.poll()                 # the newest, or None; never waits
        if frame is not None and "actor" in frame.subjects:
            actor = frame.subjects["actor"]
            actor.bones.positions             # (bones, 3), m
            actor.bone("Head").rotation       # x y z w, a view into actor.bones.rotations
"""

from .axes import AXES, Axes
from .client import Client, Statistics
from .diagnosis import Diagnosis
from .frame import Bones, Frame, Markers, Phase, State, Subject

__all__ = ["AXES", "Axes", "Bones", "Client", "Diagnosis", "Frame", "Markers", "Phase", "State", "Statistics", "Subject"]
