"""The feed of a mocapd as numpy arrays.

    from mocap_client import Client

    with Client("tcp://127.0.0.1:5570", axes="unity") as client:
        frame = client.poll()                 # the newest frame, or None; never waits
        if frame is not None and "actor" in frame.subjects:
            actor = frame.subjects["actor"]
            actor.bones.positions             # (bones, 3), m
            actor.bone("Head").rotation       # x y z w, a view into actor.bones.rotations
        client.health, client.events()        # what the daemon reports about itself

    with Control("tcp://127.0.0.1:5571") as control:
        control.stop_capture()
"""

from .axes import AXES, Axes
from .client import Client, Statistics
from .control import Code, Control, ControlError
from .diagnosis import Diagnosis
from .event import Event, EventKind
from .frame import Bones, Frame, Markers, NotTracked, Phase, State, Subject, UnknownName
from .lite import Lite, decode_lite

__all__ = ["AXES", "Axes", "Bones", "Client", "Code", "Control", "ControlError", "Diagnosis", "Event", "EventKind", "Frame", "Lite", "Markers",
           "NotTracked", "Phase", "State", "Statistics", "Subject", "UnknownName", "decode_lite"]
