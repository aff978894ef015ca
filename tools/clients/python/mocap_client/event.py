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


@dataclasses.dataclass
class Event:
    sequence: int  # a gap: events were lost
    at_ns: int  # on the daemon's monotonic clock
    kind: EventKind
    name: str  # of the subject or camera; empty: none, or not described yet
    description_version: int
    message: str  # for the operator; may be empty


def _name(message, description):
    for field, known in (("subject", "subjects"), ("camera", "cameras")):
        rows = getattr(description, known, ())
        if message.HasField(field) and getattr(message, field) < len(rows):
            return rows[getattr(message, field)].name
    return ""


def event_of(message, description):
    """Converts a message; `description` may be None."""
    kind = EventKind(message.kind) if message.kind in set(EventKind) else EventKind.UNKNOWN
    return Event(message.sequence, message.at_ns, kind, _name(message, description), message.description_version, message.message)
