"""Writes LTC into WAV files, by libltc's encoder (Debian's libltc11)."""

import ctypes
import wave


class _Timecode(ctypes.Structure):
    _fields_ = [("timezone", ctypes.c_char * 6)] + [
        (name, ctypes.c_ubyte) for name in ("years", "months", "days", "hours", "mins", "secs", "frame")]


def _library():
    library = ctypes.CDLL("libltc.so.11")
    library.ltc_encoder_create.restype = ctypes.c_void_p
    library.ltc_encoder_create.argtypes = [ctypes.c_double, ctypes.c_double, ctypes.c_int, ctypes.c_int]
    library.ltc_encoder_set_timecode.argtypes = [ctypes.c_void_p, ctypes.POINTER(_Timecode)]
    library.ltc_encoder_copy_buffer.argtypes = [ctypes.c_void_p, ctypes.c_char_p]
    library.ltc_encoder_get_buffersize.argtypes = [ctypes.c_void_p]
    library.ltc_encoder_get_buffersize.restype = ctypes.c_size_t
    for name in ("ltc_encoder_encode_frame", "ltc_encoder_inc_timecode", "ltc_encoder_free"):
        getattr(library, name).argtypes = [ctypes.c_void_p]
    return library


def write_wav(path, seconds, hours=10, rate_hz=16000):
    """Writes `seconds` of LTC with 25 frames a second that begins at `hours` o'clock."""
    library = _library()
    encoder = library.ltc_encoder_create(rate_hz, 25.0, 1, 0)
    library.ltc_encoder_set_timecode(encoder, ctypes.byref(_Timecode(b"+0000", 0, 0, 0, hours, 0, 0, 0)))
    buffer = ctypes.create_string_buffer(library.ltc_encoder_get_buffersize(encoder))
    # 16 bits of each sample of 8 bits around 128.
    wider = [((value - 128) * 256).to_bytes(2, "little", signed=True) for value in range(256)]
    with wave.open(str(path), "wb") as out:
        out.setnchannels(1)
        out.setsampwidth(2)
        out.setframerate(rate_hz)
        for _ in range(25 * seconds):
            library.ltc_encoder_encode_frame(encoder)
            count = library.ltc_encoder_copy_buffer(encoder, buffer)
            out.writeframes(b"".join(wider[value] for value in buffer.raw[:count]))
            library.ltc_encoder_inc_timecode(encoder)
    library.ltc_encoder_free(encoder)
