"""Why no data comes: the same codes and order as the C library's."""

import enum

SECOND_NS = 1_000_000_000
MAX_AHEAD_NS = 20_000_000
MAX_TRANSIT_NS = 2 * SECOND_NS  # seen when drained, not when it came
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


_HANDSHAKE = {
    Diagnosis.KEY_MISSING: "{at}: one side wants keys and the other has none: make one with 'mocapctl keys new' and allow it there, or leave ours out",
    Diagnosis.KEY_REFUSED: "{at} does not know our public key: allow it there with 'mocapctl keys allow', or it was revoked",
    Diagnosis.SERVER_KEY_WRONG: "{at} is not who our server key says: take the public key in the file that [security] server_key names there",
    Diagnosis.NOT_A_FEED: "who listens at {at} is no mocapd: check the port against [publish] endpoint",
}


def _not_connected(client):
    if client.handshake is not None:
        return client.handshake, _HANDSHAKE[client.handshake].format(at=client.endpoint)
    if client.refused or client.connections:
        return (Diagnosis.NOTHING_LISTENS,
                f"nothing listens at {client.endpoint}: start mocapd, or check address and port against [publish] endpoint")
    return Diagnosis.CONNECTING, f"connecting to {client.endpoint}"


def _silent_cameras(health):
    return ", ".join(camera.name for camera in health.cameras if camera.phase not in (STREAMING, ENDED, STOPPED))


def _cameras_silent(names):
    return (Diagnosis.CAMERAS_SILENT,
            f"no images from {names}: check power, cables and network of these cameras, then the daemon's log")


def _nothing_comes(client, now_ns):
    at = client.endpoint
    connected_ns = now_ns - client.since_ns
    if client.foreign_protocol is not None:
        return (Diagnosis.VERSION_TOO_NEW, f"{at} speaks protocol {client.foreign_protocol}, this client mocap.v1: "
                "update this client, or the daemon if it is the older")
    if client.description is None:
        if connected_ns < 1.5 * SECOND_NS:
            return Diagnosis.CONNECTING, f"connected to {at}, waiting for its description"
        return Diagnosis.NO_DESCRIPTION, f"{at} never says what it sends: is it a mocapd's feed, and not its control port?"
    if client.health is not None and (names := _silent_cameras(client.health)):
        return _cameras_silent(names)
    ended = client.health is not None and any(camera.phase in (ENDED, STOPPED) for camera in client.health.cameras)
    if ended:
        return Diagnosis.NO_SNAPSHOTS, f"no snapshots from {at}: capture was stopped there, or its recording has ended; start it again"
    if connected_ns < SECOND_NS:
        return Diagnosis.CONNECTING, f"connected to {at}, waiting for a snapshot"
    return Diagnosis.NO_SNAPSHOTS, f"no snapshots on topic '{client.topic}' from {at}: check the topic, and the daemon's log"


def diagnose(client, now_ns):
    """(Diagnosis, a sentence that says what helps) of a client's _State."""
    if not client.connected:
        return _not_connected(client)
    if client.last_frame_ns is None or now_ns - client.last_frame_ns > SECOND_NS or client.foreign_protocol is not None:
        return _nothing_comes(client, now_ns)
    if client.health is not None and (names := _silent_cameras(client.health)):
        return _cameras_silent(names)
    if client.transit_ns is not None and not -MAX_AHEAD_NS <= client.transit_ns <= MAX_TRANSIT_NS:
        return (Diagnosis.CLOCK_SKEW, f"the clock of {client.endpoint} is {-client.transit_ns // 1_000_000} ms ahead of ours: "
                "let both follow one time server (chrony or PTP)")
    if client.phases and 2 not in client.phases:
        return (Diagnosis.SUBJECT_SEARCHING, "snapshots come and nobody is recognised: stand in T-pose in view of three cameras, "
                "check the marker set")
    return Diagnosis.WELL, "all is well"
