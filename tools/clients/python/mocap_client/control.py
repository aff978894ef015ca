"""Requests to a running daemon, as mocapctl sends them."""

import enum
import threading
import time

import mocap.v1.control_pb2 as control_pb2
import zmq
from google.protobuf.message import DecodeError

from . import frame as frames
from .axes import AXES
from .diagnosis import OF_FAULT, Diagnosis
from .link import Link, read_keys

FAULT_IS_FINAL_S = 0.8  # a fault of the connection that persists for this time is reported
HANDSHAKE_MS = 700  # a peer that does not answer the handshake is not a daemon
MAX_TRIES = 3  # of a snapshot whose description changed between the two requests


class Code(enum.IntEnum):
    NO_ANSWER = 0  # ControlError.diagnosis has the reason
    DONE = 1
    INVALID = 2
    NOT_FOUND = 3  # no such subject or camera
    FORBIDDEN = 4  # the role of this client's key does not permit the request
    UNSUPPORTED = 5
    TIMEOUT = 6  # the request may still be executed
    FAILED = 7


class ControlError(Exception):
    """The daemon did not do what was requested. The text names the fault and its remedy."""

    def __init__(self, code, message, diagnosis=Diagnosis.WELL):
        super().__init__(message)
        self.code = code
        self.diagnosis = diagnosis  # why no answer came; WELL with an answer


class Control:
    """A connection to the control endpoint. Any thread may call; requests are sent one after another.

    Each method returns when the daemon has answered: the text of the answer for the operator, unless stated otherwise. It
    raises ControlError if the daemon refuses, or if no answer comes within timeout_s; without a connection after about 1 s.
    server_key, secret_key, public_key: as in Client.
    """

    def __init__(self, endpoint="tcp://127.0.0.1:5571", timeout_s=5.0, axes="mocap", *, server_key=None, secret_key=None,
                 public_key=None):
        if axes not in AXES:
            raise ValueError(f"axes is {axes!r}, expected one of {', '.join(AXES)}")
        self.endpoint, self.timeout_s = endpoint, timeout_s
        self._axes = AXES[axes]
        self._lock = threading.Lock()
        self._next_id = 1
        self._unanswered = False  # the answer to an earlier request may still arrive
        self._link = Link(zmq.DEALER, endpoint, read_keys(server_key, secret_key, public_key), ((zmq.HANDSHAKE_IVL, HANDSHAKE_MS),))

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def close(self):
        with self._lock:
            self._link.close()

    # For every role

    def status(self):
        """The message mocap.v1.Status: producer, session_id, capturing, role, subjects and health."""
        return self.ask(control_pb2.Request(status={})).status

    def description(self):
        """The message mocap.v1.Description: cameras, subjects, bones and markers."""
        return self.ask(control_pb2.Request(description={})).description

    def snapshot(self):
        """The next Frame with all its parts, without a subscription."""
        for _ in range(MAX_TRIES):
            description = self.description()
            message = self.ask(control_pb2.Request(snapshot={})).snapshot
            if message.description_version == description.version:
                return frames.frame_of(message, description, self._axes, same_clock=False)
        raise ControlError(Code.FAILED, f"{self.endpoint}: the description changes with each snapshot, try again")

    # For the role operator

    def start_capture(self):
        return self._do(capture={"action": control_pb2.CaptureRequest.ACTION_START})

    def stop_capture(self):
        """Stops the cameras. The feed continues, and the fits of the subjects are kept."""
        return self._do(capture={"action": control_pb2.CaptureRequest.ACTION_STOP})

    def add_subject(self, name, marker_set=None):
        """Searches for a subject again; with marker_set, an absolute path on the daemon's machine: adds a new subject."""
        return self._subject("ADD", name, marker_set=marker_set)

    def remove_subject(self, name):
        """The subject is away: the daemon does not search for it."""
        return self._subject("REMOVE", name)

    def reset_subject(self, name):
        """Discards pose and fit of the subject; the next T-pose or A-pose gives them again."""
        return self._subject("RESET", name)

    def fit_subject(self, name, rest_offsets_m, marker_offsets_m, residual_m=0.0):
        """Gives the subject a fit: x y z of each bone and of each marker, in the order of the description and the axes of the
        feed."""
        flat = [[float(value) for row in rows for value in row] for rows in (rest_offsets_m, marker_offsets_m)]
        return self._subject("FIT", name, rest_offsets_m=flat[0], marker_offsets_m=flat[1], residual_m=residual_m)

    def set_camera(self, name, exposure_us=None, gain_db=None):
        """Sets exposure and gain until the daemon starts again; None: unchanged."""
        return self._do(camera={"name": name, "exposure_us": exposure_us, "gain_db": gain_db})

    def learn_mask(self, camera=None, images=None, timeout_s=None):
        """Masks the lights of the empty volume in the images of one camera or of all. images: of each camera, 100 if None."""
        return self._do(timeout_s, mask={"camera": camera, "images": images})

    def reload(self, timeout_s=None):
        """The daemon reads its configuration again; what did not change continues. Nothing changes if the configuration has a fault."""
        return self._do(timeout_s, reload={})

    def start_take(self, name="", slate="", notes="", before_s=0.0, seconds=0.0, countdown_s=0.0, at_utc_ns=0):
        """Records a take. name: of the file, "": by [takes] name; before_s: pre-roll: the take begins this long before its start
        time; seconds: its length, 0: until stop_take; countdown_s, at_utc_ns: the take starts later."""
        return self._take("START", name=name, slate=slate, text=notes, before_s=before_s, seconds=seconds, countdown_s=countdown_s,
                          at_utc_ns=at_utc_ns)

    def stop_take(self, timeout_s=30.0):
        """Ends the take. The answer, which names the file, comes when the file is on the disk."""
        return self._take("STOP", timeout_s)

    def cancel_take(self):
        """Ends the take and deletes its file."""
        return self._take("CANCEL")

    def mark_take(self, text):
        """Writes an event with the text into the take."""
        return self._take("MARK", text=text)

    def next_take(self, timeout_s=30.0):
        """Ends the take, if one is recorded, and starts the next one of the same slate."""
        return self._take("NEXT", timeout_s)

    # Any request

    def ask(self, request, timeout_s=None):
        """Sends a mocap.v1.Request (its id is overwritten) and returns the mocap.v1.Answer, whose code is DONE."""
        with self._lock:
            request.id, self._next_id = self._next_id, self._next_id + 1
            payload = self._exchange(request.SerializeToString(), self.timeout_s if timeout_s is None else timeout_s)
        try:
            answer = control_pb2.Answer.FromString(payload)
        except DecodeError:
            answer = None
        if answer is None or answer.id not in (0, request.id):
            raise ControlError(Code.NO_ANSWER, f"{self.endpoint}: the answer to another request, or no answer of a mocapd",
                               Diagnosis.NOT_A_FEED)
        if answer.code != Code.DONE:
            raise ControlError(Code(answer.code) if answer.code in set(Code) - {Code.NO_ANSWER} else Code.FAILED, answer.message)
        return answer

    def _do(self, timeout_s=None, **what):
        return self.ask(control_pb2.Request(**what), timeout_s).message

    def _take(self, action, timeout_s=None, **more):
        return self._do(timeout_s, take={"action": control_pb2.TakeRequest.Action.Value(f"ACTION_{action}"), **more})

    def _subject(self, action, name, **more):
        action = control_pb2.SubjectRequest.Action.Value(f"ACTION_{action}")
        return self._do(subject={"action": action, "name": name, **more})

    def _send(self, payload):
        """Sends a request, unless the connection was rejected: then the socket has no queue, and _exchange tries again."""
        link = self._link
        # Until the number of connections exceeds this one, no daemon can have received the request.
        self._without_daemon = link.connections - 1 if link.connected else link.connections
        try:
            link.socket.send(payload, zmq.DONTWAIT)
            self._sent = self._unanswered = True
        except zmq.Again:
            self._sent = False

    def _exchange(self, payload, timeout_s):
        link = self._link
        link.watch()
        if self._unanswered or link.gave_up():
            link.open()
            self._unanswered = False
        self._send(payload)
        until = time.monotonic() + timeout_s
        failing_since = None
        while True:
            link.watch()
            try:
                answer = link.socket.recv(zmq.DONTWAIT)
                self._unanswered = False
                return answer
            except zmq.Again:
                pass
            now = time.monotonic()
            failing_since = None if link.fault is None else now if failing_since is None else failing_since
            if now >= until or (failing_since is not None and now - failing_since >= FAULT_IS_FINAL_S):
                raise self._no_answer(timeout_s)
            if link.gave_up():
                received = self._sent and link.connections != self._without_daemon
                link.open()
                if not received:
                    self._send(payload)
            link.socket.poll(min(until - now, 0.05) * 1000)

    def _no_answer(self, timeout_s):
        link = self._link
        if link.fault is not None:
            return ControlError(Code.NO_ANSWER, link.explain("[control] endpoint"), OF_FAULT[link.fault])
        why = ("connected, but the daemon is busy; try again or set a longer timeout_s" if link.connected else
               "nothing answers at this address: check the address, the network and firewalls")
        return ControlError(Code.NO_ANSWER, f"{self.endpoint}: no answer within {timeout_s:.1f} s: {why}", Diagnosis.NO_ANSWER)
