"""Changes of state that the daemon reports once each (proto/mocap/v1/event.proto)."""

import dataclasses
import enum


class EventKind(enum.IntEnum):
    UNKNOWN = 0  # of a later version of the daemon
    SUBJECT_FOUND = 1
    SUBJECT_LOST = 2
    DESCRIPTION_CHANGED = 3
    CAMERA_LOST = 4
    CAMERA_BACK = 5
    TAKE_STARTED = 6  # message: its name
    TAKE_ENDED = 7  # the file is complete; message: its name and its quality
    TAKE_FAILED = 8  # ended early; message: its name and the reason
    MARK = 9  # of an operator; only in takes


@dataclasses.dataclass
class Event:
    sequence: int  # a gap: events were lost
    at_ns: int  # on the daemon's monotonic clock
    kind: EventKind
    name: str  # of the subject or camera; empty: none, or not described yet
    description_version: int
    message: str  # for the operator; may be empty
    kind_number: int = 0  # the kind in event.proto, also if kind is UNKNOWN


def _name(message, description):
    for field, known in (("subject", "subjects"), ("camera", "cameras")):
        rows = getattr(description, known, ())
        if message.HasField(field) and getattr(message, field) < len(rows):
            return rows[getattr(message, field)].name
    return ""


def event_of(message, description):
    """Converts a message; `description` may be None."""
    kind = EventKind(message.kind) if message.kind in set(EventKind) else EventKind.UNKNOWN
    return Event(message.sequence, message.at_ns, kind, _name(message, description), message.description_version, message.message,
                 message.kind)
