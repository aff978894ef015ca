"""The reason why no data arrives, with the codes and the order of checks of the C library."""

import enum

from .link import Fault, explain

SECOND_NS = 1_000_000_000
MAX_AHEAD_NS = 20_000_000
MAX_TRANSIT_NS = 2 * SECOND_NS  # includes the time in the queue of the socket, because messages are read only when polled
ENDED, STOPPED, STREAMING = 5, 6, 2  # CameraPhase of health.proto


class Diagnosis(enum.IntEnum):
    WELL = 0
    NOTHING_LISTENS = 1
    NOT_A_FEED = 2
    KEY_MISSING = 3
    KEY_REFUSED = 4
    SERVER_KEY_WRONG = 5
    NO_DESCRIPTION = 6
    VERSION_TOO_NEW = 7
    CAMERAS_SILENT = 8
    NO_SNAPSHOTS = 9
    SUBJECT_SEARCHING = 10
    CLOCK_SKEW = 11
    CONNECTING = 12
    NO_ANSWER = 13  # connected to a control endpoint, but no answer within the timeout


OF_FAULT = {
    Fault.NOTHING_LISTENS: Diagnosis.NOTHING_LISTENS,
    Fault.NOT_A_DAEMON: Diagnosis.NOT_A_FEED,
    Fault.CLOSED_BY_PEER: Diagnosis.NOT_A_FEED,
    Fault.KEY_MISSING: Diagnosis.KEY_MISSING,
    Fault.KEY_NOT_WANTED: Diagnosis.KEY_MISSING,
    Fault.KEY_REFUSED: Diagnosis.KEY_REFUSED,
    Fault.SERVER_KEY_WRONG: Diagnosis.SERVER_KEY_WRONG,
}


def _not_connected(link):
    fault = link.fault or (Fault.NOTHING_LISTENS if link.connections else None)
    if fault is None:
        return Diagnosis.CONNECTING, f"connecting to {link.endpoint}"
    return OF_FAULT[fault], explain(fault, link.endpoint, "[publish] endpoint")


def _silent_cameras(health):
    return ", ".join(camera.name for camera in health.cameras if camera.phase not in (STREAMING, ENDED, STOPPED))


def _cameras_silent(names):
    return (Diagnosis.CAMERAS_SILENT,
            f"no images from {names}: check power, cables and network of these cameras, then the daemon's log")


def _no_snapshots(client, now_ns):
    at = client.endpoint
    connected_ns = now_ns - client.link.since_ns
    if client.foreign_protocol is not None:
        return (Diagnosis.VERSION_TOO_NEW, f"{at} speaks protocol {client.foreign_protocol}, this client mocap.v1: "
                "update this client, or the daemon if it is older")
    if client.description is None:
        if connected_ns < 1.5 * SECOND_NS:
            return Diagnosis.CONNECTING, f"connected to {at}, waiting for its description"
        return Diagnosis.NO_DESCRIPTION, f"{at} sends no description: is it the feed of a mocapd, and not its control port?"
    if client.health is not None and (names := _silent_cameras(client.health)):
        return _cameras_silent(names)
    ended = client.health is not None and any(camera.phase in (ENDED, STOPPED) for camera in client.health.cameras)
    if ended:
        return Diagnosis.NO_SNAPSHOTS, f"no snapshots from {at}: the capture there was stopped, or its recording has ended; start it again"
    if connected_ns < SECOND_NS:
        return Diagnosis.CONNECTING, f"connected to {at}, waiting for a snapshot"
    return Diagnosis.NO_SNAPSHOTS, f"no snapshots on topic '{client.topic}' from {at}: check the topic, and the daemon's log"


def diagnose(client, now_ns):
    """Returns (Diagnosis, a sentence with the reason and a remedy) for the state of a client."""
    if not client.link.connected:
        return _not_connected(client.link)
    if client.last_frame_ns is None or now_ns - client.last_frame_ns > SECOND_NS or client.foreign_protocol is not None:
        return _no_snapshots(client, now_ns)
    if client.health is not None and (names := _silent_cameras(client.health)):
        return _cameras_silent(names)
    transit_ns = client.transit_ns()
    if transit_ns is not None and not -MAX_AHEAD_NS <= transit_ns <= MAX_TRANSIT_NS:
        return (Diagnosis.CLOCK_SKEW, f"the clock of {client.endpoint} is {-transit_ns // 1_000_000} ms ahead of this machine's: "
                "synchronise both with one time server (chrony or PTP)")
    missing = "; ".join(search.sentence for search in client.health.searches) if client.health is not None else ""
    if client.phases and 2 not in client.phases:
        if missing:
            return Diagnosis.SUBJECT_SEARCHING, missing
        return (Diagnosis.SUBJECT_SEARCHING, "snapshots arrive, but no subject is identified: stand in T-pose in view of three cameras, "
                "check the marker set")
    return Diagnosis.WELL, "all is well" + (f", but {missing}" if missing else "")
