"""Sounds, streams, groups and sources of the application's own."""
from __future__ import annotations

import os
from ctypes import c_float
from typing import Any, Callable, Optional, Sequence, Union

import numpy as np

from . import _arguments as given
from ._library import runtime as native
from .world import Context, Level, _Owned

# A callback that fills samples (frames,) float32 and returns how many it had.
Pull = Callable[[np.ndarray], int]


def _samples(samples: Any, name: str) -> np.ndarray:
    array = given.array(samples, name, "(frames,)", np.float32)
    if array.ndim != 1:
        raise ValueError(f"{name} must have the shape (frames,), not {array.shape}")
    return array


class Sound(_Owned):
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
        if isinstance(sound, (str, os.PathLike)):
            how = "clamor_read_sound", given.text(sound, "sound"), options
        elif isinstance(sound, tuple) and len(sound) == 2 and isinstance(sound[0], Level):
            level, number = sound
            given.index(number, "number", level.info.sounds, "sounds")
            how = "clamor_read_level_sound", level._handle, number
        else:
            samples = _samples(sound, "sound")
            how = "clamor_add_sound", samples.ctypes.data, len(samples), options
        self._own(context, "clamor_remove_sound", *how)


class Stream(_Owned):
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
                return int(pull(np.ctypeslib.as_array((c_float * frames).from_address(samples))))
            except Exception:  # no exception can pass through the library; it hears silence
                return 0

        given.instance(context, Context, "context")
        options = native.clamor_stream(rate_hz=given.whole(rate_hz, "rate_hz", 8000, 192_000))
        if given.function(pull, "pull") is None:
            self._own(context, "clamor_remove_sound", "clamor_add_stream", options)
        else:
            options.pull = native.clamor_stream_pull(fill)
            self._own_keeping(options.pull, context, "clamor_remove_sound", "clamor_add_stream", options)

    def write(self, samples: Any) -> int:
        """Appends samples (frames,) and returns how many fitted into the buffer of one second."""
        array = _samples(samples, "samples")
        return self._call("clamor_write_stream", array.ctypes.data, len(array))


class Group(_Owned):
    """A group of sources with a gain (an amplitude), mute, pause, and a share of the voices."""

    def __init__(self, context: Context, gain: float = 1.0, is_muted: bool = False,
                 is_paused: bool = False, max_voices: float = 1.0):
        given.instance(context, Context, "context")
        self._own(context, "clamor_remove_group", "clamor_add_group",
                  self._options(gain, is_muted, is_paused, max_voices))

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
        self._call("clamor_change_group", self._options(gain, is_muted, is_paused, max_voices))


class Source(_Owned):
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
        chosen = self._options(sound, position_m, **options)
        self._uses = (sound, options.get("group"))  # which are removed when nothing holds them
        self._own(context, "clamor_remove_source", "clamor_add_source", chosen)

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
        self._call("clamor_change_source", self._options(sound, position_m, **options))
        self._uses = (sound, options.get("group"))

    def move(self, position_m: Sequence[float], velocity_mps: Sequence[float] = (0, 0, 0),
             axis: Sequence[float] = (0, 0, -1)) -> None:
        """Moves it, with the next commit."""
        self._call("clamor_move_source", _motion(position_m, velocity_mps, axis))


def _motion(position_m: Sequence[float], velocity_mps: Sequence[float],
            axis: Sequence[float]) -> Any:
    facing = given.vector(axis, "axis", 1e3)
    if not any(facing):
        raise ValueError("axis must not be 0, 0, 0; ahead is 0, 0, -1")
    return native.clamor_motion(
        position_m=given.vector(position_m, "position_m", given.MAX_PLACE_M),
        velocity_mps=given.vector(velocity_mps, "velocity_mps", 1e4), axis=facing)
