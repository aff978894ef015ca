"""Writes LTC into WAV files and plays it on sound devices, by libltc's encoder (Debian's libltc11).

usage: ltc.py DEVICE SECONDS HOURS    plays LTC that begins at HOURS o'clock
"""

import ctypes
import sys
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


def frames(seconds, hours, rate_hz):
    """Yields each of `seconds` * 25 frames of LTC that begins at `hours` o'clock: 16-bit samples as bytes."""
    library = _library()
    encoder = library.ltc_encoder_create(rate_hz, 25.0, 1, 0)
    library.ltc_encoder_set_timecode(encoder, ctypes.byref(_Timecode(b"+0000", 0, 0, 0, hours, 0, 0, 0)))
    buffer = ctypes.create_string_buffer(library.ltc_encoder_get_buffersize(encoder))
    # 16 bits of each sample of 8 bits around 128.
    wider = [((value - 128) * 256).to_bytes(2, "little", signed=True) for value in range(256)]
    for _ in range(25 * seconds):
        library.ltc_encoder_encode_frame(encoder)
        count = library.ltc_encoder_copy_buffer(encoder, buffer)
        yield b"".join(wider[value] for value in buffer.raw[:count])
        library.ltc_encoder_inc_timecode(encoder)
    library.ltc_encoder_free(encoder)


def write_wav(path, seconds, hours=10, rate_hz=16000):
    """Writes `seconds` of LTC with 25 frames a second that begins at `hours` o'clock."""
    with wave.open(str(path), "wb") as out:
        out.setnchannels(1)
        out.setsampwidth(2)
        out.setframerate(rate_hz)
        for samples in frames(seconds, hours, rate_hz):
            out.writeframes(samples)


def play(device, seconds, hours=10, rate_hz=48000):
    """Plays `seconds` of LTC on a sound device of ALSA."""
    library = ctypes.CDLL("libasound.so.2")
    library.snd_strerror.restype = ctypes.c_char_p
    library.snd_pcm_writei.restype = ctypes.c_long
    library.snd_pcm_writei.argtypes = [ctypes.c_void_p, ctypes.c_char_p, ctypes.c_ulong]

    def check(result):
        if result < 0:
            raise OSError(-result, f"{device}: {library.snd_strerror(ctypes.c_int(result)).decode()}")
        return result

    pcm = ctypes.c_void_p()
    playback, s16_le, interleaved, latency_us = 0, 2, 3, 1_000_000
    check(library.snd_pcm_open(ctypes.byref(pcm), device.encode(), playback, 0))
    check(library.snd_pcm_set_params(pcm, s16_le, interleaved, 1, rate_hz, 0, latency_us))
    for samples in frames(seconds, hours, rate_hz):
        written = library.snd_pcm_writei(pcm, samples, len(samples) // 2)
        if written < 0:  # the device ran empty: this frame is lost
            check(library.snd_pcm_recover(pcm, ctypes.c_int(written), 1))
        elif written * 2 < len(samples):
            raise OSError(f"{device}: took a part of a frame")
    library.snd_pcm_close(pcm)


if __name__ == "__main__":
    play(sys.argv[1], int(sys.argv[2]), int(sys.argv[3]))
