"""Sounds, streams, groups and sources of the application's own."""
from __future__ import annotations

import os
import weakref
from ctypes import byref, c_uint32, c_uint64
from typing import Any, Callable, Optional, Sequence, Union

import numpy as np

from . import _arguments as given
from . import _interface as native
from ._interface import check, library
from .world import Context, Level, _close, _numbers, _Owner, _release, _used_by_library

# A callback that fills samples (frames,) float32 and returns how many it had.
Pull = Callable[[np.ndarray], int]


class _InContext(_Owner):
    context: Context

    def _own(self, context: Context, handle: int, function: str) -> None:
        self.context, self._handle = context, handle
        self._finalizer = weakref.finalize(self, _close, context, function, handle)


def _samples(samples: Any, name: str) -> np.ndarray:
    array = given.array(samples, name, "(frames,)", np.float32)
    if array.ndim != 1:
        raise ValueError(f"{name} must have the shape (frames,), not {array.shape}")
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
        given.instance(context, Context, "context")
        options = native.clamor_sound_options(rate_hz=given.whole(rate_hz, "rate_hz", 1000, 768_000),
                                              loops=given.flag(loops, "loops"))
        handle, error = c_uint64(), native.clamor_error()
        if isinstance(sound, (str, os.PathLike)):
            code = library().clamor_read_sound(context._open, given.text(sound, "sound"), byref(options),
                                               byref(handle), byref(error))
        elif isinstance(sound, tuple) and len(sound) == 2 and isinstance(sound[0], Level):
            level, number = sound
            given.index(number, "number", level.info.sounds, "sounds")
            code = library().clamor_read_level_sound(context._open, level._handle, number,
                                                     byref(handle), byref(error))
        else:
            samples = _samples(sound, "sound")
            code = library().clamor_add_sound(context._open, samples.ctypes.data, len(samples),
                                              byref(options), byref(handle), byref(error))
        check(code, error)
        self._own(context, handle.value, "clamor_remove_sound")


class Stream(_InContext):
    """A sound whose samples arrive while it plays.

    Args:
        context: as for Sound. rate_hz: 8000 to 192 000.
        pull: fills a float32 array (frames,) and returns how many samples it had; the rest are
            silence. The array is the library's and ends with the call. The thread that makes keyframes calls it, about 90 ms ahead of the sound. It
            must not call the context. None: call write().
    """

    def __init__(self, context: Context, rate_hz: int = 48000, pull: Optional[Pull] = None):
        def fill(_: Any, samples: Any, frames: int) -> int:
            try:
                return int(pull(np.ctypeslib.as_array(samples, (frames,))))
            except Exception:  # no exception can pass through the library; it hears silence
                return 0

        given.instance(context, Context, "context")
        options = native.clamor_stream(rate_hz=given.whole(rate_hz, "rate_hz", 8000, 192_000))
        if given.function(pull, "pull") is not None:
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
        array, taken = _samples(samples, "samples"), c_uint32()
        check(library().clamor_write_stream(self.context._open, self._handle, array.ctypes.data,
                                            len(array), byref(taken)))
        return taken.value


class Group(_InContext):
    """A group of sources with a gain (an amplitude), mute, pause, and a share of the voices."""

    def __init__(self, context: Context, gain: float = 1.0, is_muted: bool = False,
                 is_paused: bool = False, max_voices: float = 1.0):
        given.instance(context, Context, "context")
        handle = c_uint64()
        options = self._options(gain, is_muted, is_paused, max_voices)
        check(library().clamor_add_group(context._open, byref(options), byref(handle)))
        self._own(context, handle.value, "clamor_remove_group")

    @staticmethod
    def _options(gain: float, is_muted: bool, is_paused: bool, max_voices: float) -> Any:
        if given.number(max_voices, "max_voices", 0, 1) == 0:
            raise ValueError("max_voices is 0, but must be more than 0; mute the group instead")
        return native.clamor_group_options(is_muted=given.flag(is_muted, "is_muted"),
                                           is_paused=given.flag(is_paused, "is_paused"), has_gain=1,
                                           gain=given.number(gain, "gain", 0, 1e6),
                                           max_voices=max_voices)

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
        given.instance(context, Context, "context")
        handle, chosen = c_uint64(), self._options(sound, position_m, **options)
        check(library().clamor_add_source(context._open, byref(chosen), byref(handle)))
        self._uses = (sound, options.get("group"))  # which are removed when nothing holds them
        self._own(context, handle.value, "clamor_remove_source")

    @staticmethod
    def _options(sound: Union[Sound, Stream], position_m: Sequence[float], *,
                 velocity_mps: Sequence[float] = (0, 0, 0), axis: Sequence[float] = (0, 0, -1),
                 group: Optional[Group] = None, level: Optional[Level] = None, gain: float = 1.0,
                 band_gains: Any = 1.0, directivity: Any = 0.0, played_s: float = 0.0,
                 reverberation: float = 1.0, ends_with_sound: bool = False) -> Any:
        if given.number(gain, "gain", 0, 1e6) == 0:
            raise ValueError("gain must be more than 0; mute a source by its group or its bands")
        return native.clamor_source_options(
            ends_with_sound=given.flag(ends_with_sound, "ends_with_sound"),
            sound=given.instance(sound, (Sound, Stream), "sound")._handle,
            group=given.handle_of(group, Group, "group"),
            level=given.handle_of(level, Level, "level"),
            motion=_motion(position_m, velocity_mps, axis), gain=gain,
            band_gains=given.bands(band_gains, "band_gains", 0, 1e6 / gain),
            directivity=given.bands(directivity, "directivity", 0, 1e4),
            played_s=given.number(played_s, "played_s", 0, 1e6), has_reverberation=1,
            reverberation=given.number(reverberation, "reverberation", 0, 100))

    def change(self, sound: Union[Sound, Stream], position_m: Sequence[float], **options: Any) -> None:
        """Sets all of its properties; another sound begins anew."""
        chosen = self._options(sound, position_m, **options)
        check(library().clamor_change_source(self.context._open, self._handle, byref(chosen)))
        self._uses = (sound, options.get("group"))

    def move(self, position_m: Sequence[float], velocity_mps: Sequence[float] = (0, 0, 0),
             axis: Sequence[float] = (0, 0, -1)) -> None:
        """Moves it, with the next commit."""
        motion = _motion(position_m, velocity_mps, axis)
        check(library().clamor_move_source(self.context._open, self._handle, byref(motion)))


def _motion(position_m: Sequence[float], velocity_mps: Sequence[float],
            axis: Sequence[float]) -> native.clamor_motion:
    facing = given.vector(axis, "axis", 1e3)
    if not any(facing):
        raise ValueError("axis must not be 0, 0, 0; ahead is 0, 0, -1")
    return native.clamor_motion(
        position_m=given.vector(position_m, "position_m", given.MAX_PLACE_M),
        velocity_mps=given.vector(velocity_mps, "velocity_mps", 1e4), axis=facing)
