"""Sounds, streams, groups and sources of the application's own."""
from __future__ import annotations

import ctypes
import os
import weakref
from ctypes import byref, c_double, c_uint32, c_uint64
from typing import Any, Callable, Dict, Optional, Sequence, Union

import numpy as np

from . import _interface as native
from ._interface import check, library
from ._library import utf8
from .world import Context, Level, _close, _numbers, _Owner, _release, _used_by_library

# A callback that fills samples (frames,) float32 and returns how many it had.
Pull = Callable[[np.ndarray], int]


class _InContext(_Owner):
    def _own(self, context: Context, handle: int, function: str) -> None:
        self.context, self._handle = context, handle
        self._finalizer = weakref.finalize(self, _close, context, function, handle)


def _samples(samples: Any) -> np.ndarray:
    array = np.ascontiguousarray(samples, np.float32)
    if array.ndim != 1:
        raise ValueError(f"samples must have the shape (frames,), not {array.shape}")
    return array


class Sound(_InContext):
    """A sound that any number of sources play, mono, in memory.

    Args:
        context: whose sources play it.
        sound: samples (frames,), 1 at full scale, which are copied; or the path of a WAV, FLAC, Ogg
            or MP3 file, whose channels are averaged; or the pair (Level, number) of a level's own.
        rate_hz: of the samples.
        loops: plays without end.

    close(), or losing the object, removes the sound with all sources that play it at the next
    commit. Raises ClamorError if a file cannot be read.
    """

    def __init__(self, context: Context, sound: Any, rate_hz: int = 48000, loops: bool = False):
        options = native.clamor_sound_options(rate_hz=rate_hz, loops=loops)
        handle, error = c_uint64(), native.clamor_error()
        if isinstance(sound, (str, os.PathLike)):
            code = library().clamor_read_sound(context._open, utf8(sound), byref(options),
                                               byref(handle), byref(error))
        elif isinstance(sound, tuple) and isinstance(sound[0], Level):
            code = library().clamor_read_level_sound(context._open, sound[0]._handle, sound[1],
                                                     byref(handle), byref(error))
        else:
            samples = _samples(sound)
            code = library().clamor_add_sound(context._open, samples.ctypes.data, len(samples),
                                              byref(options), byref(handle), byref(error))
        check(code, error)
        self._own(context, handle.value, "clamor_remove_sound")


class Stream(_InContext):
    """A sound whose samples arrive while it plays.

    Args:
        context, rate_hz: as for Sound.
        pull: fills a float32 array (frames,) and returns how many samples it had; the rest are
            silence. The thread that makes keyframes calls it, about 90 ms ahead of the sound. It
            must not call the context. None: call write().
    """

    def __init__(self, context: Context, rate_hz: int = 48000, pull: Optional[Pull] = None):
        def fill(_: Any, samples: Any, frames: int) -> int:
            try:
                return int(pull(np.ctypeslib.as_array(samples, (frames,))))
            except Exception:  # no exception can pass through the library; it hears silence
                return 0

        options = native.clamor_stream(rate_hz=rate_hz)
        if pull is not None:
            options.user, options.pull = next(_numbers), native.PullFunction(fill)
            options.release = _release
            _used_by_library[options.user] = options.pull
        handle, error = c_uint64(), native.clamor_error()
        code = library().clamor_add_stream(context._open, byref(options), byref(handle),
                                           byref(error))
        if code != native.CLAMOR_OK:
            _used_by_library.pop(options.user, None)
        check(code, error)
        self._own(context, handle.value, "clamor_remove_sound")

    def write(self, samples: Any) -> int:
        """Appends samples (frames,) and returns how many fitted into the buffer of one second."""
        array, taken = _samples(samples), c_uint32()
        check(library().clamor_write_stream(self.context._open, self._handle, array.ctypes.data,
                                            len(array), byref(taken)))
        return taken.value


class Group(_InContext):
    """A group of sources with a gain (an amplitude), mute, pause, and a share of the voices."""

    def __init__(self, context: Context, gain: float = 1.0, is_muted: bool = False,
                 is_paused: bool = False, max_voices: float = 1.0):
        handle = c_uint64()
        options = self._options(gain, is_muted, is_paused, max_voices)
        check(library().clamor_add_group(context._open, byref(options), byref(handle)))
        self._own(context, handle.value, "clamor_remove_group")

    @staticmethod
    def _options(gain: float, is_muted: bool, is_paused: bool, max_voices: float) -> Any:
        return native.clamor_group_options(is_muted=is_muted, is_paused=is_paused, has_gain=1,
                                           gain=gain, max_voices=max_voices)

    def change(self, gain: float = 1.0, is_muted: bool = False, is_paused: bool = False,
               max_voices: float = 1.0) -> None:
        """Sets all of its properties, with the next commit."""
        options = self._options(gain, is_muted, is_paused, max_voices)
        check(library().clamor_change_group(self.context._open, self._handle, byref(options)))


class Source(_InContext):
    """A source that you move. It begins with the next Context.commit().

    Args:
        context: whose listeners hear it.
        sound: a Sound or a Stream.
        position_m, velocity_mps, axis: (3,) each; without a velocity it is that between commits.
        group, level: a Group, and the Level whose listeners alone hear it; None: none, and all.
        gain: amplitude at 1 m; more than 0.
        band_gains: (8,) amplitudes for 63 Hz to 8 kHz.
        directivity: exponent of ((1 + cos) / 2) about the axis, a number or (8,).
        played_s: how much of the sound has been played when it begins.
        reverberation: amplitude of its reflections, which are those of the probes of the bake; 0:
            direct sound only.
        ends_with_sound: the handle ends some seconds after the sound has.
    """

    def __init__(self, context: Context, sound: Union[Sound, Stream],
                 position_m: Sequence[float] = (0, 0, 0), **options: Any):
        handle = c_uint64()
        given = self._options(sound, position_m, **options)
        check(library().clamor_add_source(context._open, byref(given), byref(handle)))
        self._uses = (sound, options.get("group"))  # which are removed when nothing holds them
        self._own(context, handle.value, "clamor_remove_source")

    @staticmethod
    def _options(sound: Union[Sound, Stream], position_m: Sequence[float], *,
                 velocity_mps: Sequence[float] = (0, 0, 0), axis: Sequence[float] = (0, 0, -1),
                 group: Optional[Group] = None, level: Optional[Level] = None, gain: float = 1.0,
                 band_gains: Any = 1.0, directivity: Any = 0.0, played_s: float = 0.0,
                 reverberation: float = 1.0, ends_with_sound: bool = False) -> Any:
        def bands(values: Any) -> Any:
            return (c_double * 8)(*np.broadcast_to(np.asarray(values, float), 8).tolist())

        if not gain > 0:
            raise ValueError("gain must be more than 0; mute a source by its group or its bands")
        return native.clamor_source_options(
            ends_with_sound=ends_with_sound, sound=sound._handle,
            group=group._handle if group else 0, level=level._handle if level else 0,
            motion=_motion(position_m, velocity_mps, axis), gain=gain,
            band_gains=bands(band_gains), directivity=bands(directivity), played_s=played_s,
            has_reverberation=1, reverberation=reverberation)

    def change(self, sound: Union[Sound, Stream], position_m: Sequence[float], **options: Any) -> None:
        """Sets all of its properties; another sound begins anew."""
        given = self._options(sound, position_m, **options)
        check(library().clamor_change_source(self.context._open, self._handle, byref(given)))
        self._uses = (sound, options.get("group"))

    def move(self, position_m: Sequence[float], velocity_mps: Sequence[float] = (0, 0, 0),
             axis: Sequence[float] = (0, 0, -1)) -> None:
        """Moves it, with the next commit."""
        motion = _motion(position_m, velocity_mps, axis)
        check(library().clamor_move_source(self.context._open, self._handle, byref(motion)))


def _motion(position_m: Sequence[float], velocity_mps: Sequence[float],
            axis: Sequence[float]) -> native.clamor_motion:
    vectors: Dict[str, Any] = {"position_m": position_m, "velocity_mps": velocity_mps, "axis": axis}
    for name, vector in vectors.items():
        if len(vector) != 3:
            raise ValueError(f"{name} must have three numbers, not {len(vector)}")
    return native.clamor_motion(**{name: (ctypes.c_double * 3)(*vector)
                                   for name, vector in vectors.items()})
