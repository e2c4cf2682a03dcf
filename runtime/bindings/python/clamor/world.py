"""Contexts, levels and listeners: clamor.h with owners instead of handles."""
from __future__ import annotations

import itertools
import os
import threading
import warnings
import weakref
from ctypes import c_void_p
from typing import Any, Callable, Dict, Optional, Tuple, Union

import numpy as np

from . import _arguments as given
from ._library import ClamorWarning
from ._library import runtime as native
from .information import (EmitterInfo, LevelInfo, PartInfo, PortalInfo, Statistics,
                          information_of)
from .walk import Pose

OUTPUTS = {"binaural": native.CLAMOR_OUTPUT_BINAURAL,
           "loudspeakers": native.CLAMOR_OUTPUT_LOUDSPEAKERS,
           "ambisonics": native.CLAMOR_OUTPUT_AMBISONICS,
           "receivers": native.CLAMOR_OUTPUT_RECEIVERS,
           "none": native.CLAMOR_OUTPUT_NONE}
MIXINGS = {"auto": native.CLAMOR_MIXING_AUTO, "field": native.CLAMOR_MIXING_FIELD,
           "voices": native.CLAMOR_MIXING_VOICES}
LATE_SOUNDS = {"stored": native.CLAMOR_LATE_STORED, "dense": native.CLAMOR_LATE_DENSE}

# A path, or the bytes of a bake.
Source = Union[str, "os.PathLike[str]", bytes, bytearray, memoryview]

# Bakes in memory and callbacks that the library uses, by the number that it gives back when it no
# longer does.
_used_by_library: Dict[int, Any] = {}
_numbers = itertools.count(1)


@native.clamor_reader_release
def _release(number: int) -> None:
    _used_by_library.pop(number, None)


class _Owner:
    """Something that close(), the end of a `with` or the garbage collector gives back."""

    _finalizer: weakref.finalize

    def close(self) -> None:
        """Gives it back. Further calls do nothing."""
        self._finalizer()

    def __enter__(self):
        return self

    def __exit__(self, *_: Any) -> None:
        self.close()


class Context(_Owner):
    """A world of levels and listeners. Contexts do not see each other.

    Args:
        caller_updates: False: the library makes keyframes on a thread of its own. True: you call
            update() regularly, and the library starts no thread. Offline listeners need True.
        update_period_s: with caller_updates, the longest time between two updates; 0 means 1/30 s.
        max_sources, max_sounds: of the application's own, at a time.
        log: is called with a sentence for what no call can return: a page that cannot be read, and,
            once for each listener and level, a listener or a source that is outside the level. Any
            thread calls it, and it must not call the context. None: it is a ClamorWarning.
    """

    def __init__(self, caller_updates: bool = False, update_period_s: float = 0,
                 max_sources: int = 1024, max_sounds: int = 256,
                 log: Optional[Callable[[str], None]] = None):
        tell = given.function(log, "log") or _warn
        logger = native.clamor_options_log(
            lambda _, sentence: tell(sentence.decode("utf-8", "replace")))
        options = native.clamor_options(
            caller_updates=given.flag(caller_updates, "caller_updates"),
            update_period_s=given.number(update_period_s, "update_period_s", 0, 0.1),
            max_sources=given.whole(max_sources, "max_sources", 1, 65_536),
            max_sounds=given.whole(max_sounds, "max_sounds", 1, 4096), log=logger)
        self._pointer, self.log = c_void_p(native.call("clamor_create", options)), log
        self._finalizer = weakref.finalize(self, _destroy, self._pointer, logger)

    @property
    def _open(self) -> c_void_p:
        if not self._finalizer.alive:
            raise ValueError("the context is closed")
        return self._pointer

    def open(self, source: Source, name: str = "the level") -> "Level":
        """Opens a bake from a path or from bytes, which must not change while it is open.

        Only its first page is read. `name` stands for the path of bytes in error messages.
        Raises ClamorError if it cannot be read or is damaged.
        """
        return Level(self, source, name)

    def listen(self, level: "Level", pose: Any = (0.0, 0.0, 0.0), **options: Any) -> "Listener":
        """Adds a listener in a level; the options are those of Listener."""
        return Listener(self, level, pose, **options)

    def commit(self, time_s: float = 0) -> None:
        """Publishes all changes of sounds, sources, emitters, portals, groups and parts together.

        `time_s` is the time of an offline listener that they are for (next_keyframe_s()); listeners
        in real time take them over now.
        """
        native.call("clamor_commit", self._open, given.number(time_s, "time_s", -5e6, 5e6))

    def update(self, loading_s: float = 0) -> int:
        """Makes the keyframes that listeners want now, and returns how many.

        Then it loads pages and sounds until none are requested or `loading_s` seconds have passed.
        Only with caller_updates, on one thread at a time.
        """
        return native.call("clamor_update", self._open, given.number(loading_s, "loading_s", 0))


def _warn(sentence: str) -> None:
    warnings.warn(sentence, ClamorWarning)


def _destroy(context: c_void_p, _: Any) -> None:  # the callback lives until then
    native.library.clamor_destroy(context)


def _close(context: Context, function: str, handle: int) -> None:
    if context._finalizer.alive:  # a context takes all that belongs to it along
        getattr(native.library, function)(context._pointer, handle)


class _InContext:
    """What clamor.h names by a context and a handle."""

    context: Context
    _handle: int

    def _call(self, function: str, *arguments: Any) -> Any:
        return native.call(function, self.context._open, self._handle, *arguments)


class _Owned(_InContext, _Owner):
    """What a context holds until it is closed."""

    def _own(self, context: Context, close_function: str, function: str, *arguments: Any) -> None:
        """Makes it by a function of clamor.h; `close_function` gives it back."""
        self.context, self._handle = context, native.call(function, context._open, *arguments)
        self._finalizer = weakref.finalize(self, _close, context, close_function, self._handle)

    def _own_keeping(self, used: Any, context: Context, close_function: str, function: str,
                     options: Any) -> None:
        """Does so with options that have `release`, and keeps what the library uses until then."""
        options.user, options.release = next(_numbers), _release
        _used_by_library[options.user] = used
        try:
            self._own(context, close_function, function, options)
        except BaseException:
            _used_by_library.pop(options.user)
            raise


def _bytes(source: Any) -> np.ndarray:
    """The bytes of an object, which stay its own."""
    try:
        return np.frombuffer(source, np.uint8) if len(source) else np.empty(0, np.uint8)
    except (TypeError, ValueError, BufferError):
        raise TypeError("source must be a path or the bytes of a bake, not "
                        f"{given.shown(source)}") from None


class Level(_Owned):
    """An open bake in a context. Listeners who are in it hear it on after it is closed."""

    def __init__(self, context: Context, source: Source, name: str = "the level"):
        given.instance(context, Context, "context")
        known_as = given.text(name, "name")
        if isinstance(source, (str, os.PathLike)):
            self._own(context, "clamor_close_level", "clamor_open_level", given.text(source, "source"))
        else:
            array = _bytes(source)
            self._own_keeping(array, context, "clamor_close_level", "clamor_open_level_with",
                              native.clamor_reader(name=known_as, size=array.size,
                                                   memory=array.ctypes.data))
        self.source, self.name = source, name
        self._offline: Optional[Context] = None
        self._offline_lock = threading.Lock()

    @property
    def info(self) -> LevelInfo:
        """The numbers of emitters, sounds, sources, portals and movable parts."""
        return information_of(LevelInfo, self._call("clamor_get_level_info"))

    def _number(self, number: Any, things: str) -> int:
        return given.index(number, "number", getattr(self.info, things), things)

    def emitter(self, number: int) -> EmitterInfo:
        """The emitter number `number`, below info.emitters."""
        number = self._number(number, "emitters")
        return information_of(EmitterInfo, self._call("clamor_get_emitter_info", number))

    def find_emitter(self, name: str) -> int:
        """The number of the first emitter with this name. Raises ClamorError if there is none."""
        return self._call("clamor_find_emitter", _name(name))

    def change_emitter(self, number: int, gain: float = 1.0, is_muted: bool = False,
                       group: Any = None) -> None:
        """Turns an emitter down, with all its reflections, for all listeners from the next commit.

        `gain` is an amplitude relative to the bake's, 0 to 1, times that of the Group.
        """
        from .sources import Group  # which needs this module

        number = self._number(number, "emitters")
        options = native.clamor_emitter_options(is_muted=given.flag(is_muted, "is_muted"), has_gain=1,
                                                gain=given.number(gain, "gain", 0, 1),
                                                group=given.handle_of(group, Group, "group"))
        self._call("clamor_change_emitter", number, options)

    def portal(self, number: int) -> PortalInfo:
        """The portal number `number`, below info.portals."""
        number = self._number(number, "portals")
        return information_of(PortalInfo, self._call("clamor_get_portal_info", number))

    def find_portal(self, name: str) -> int:
        """The number of the first portal with this name. Raises ClamorError if there is none."""
        return self._call("clamor_find_portal", _name(name))

    def set_portal(self, number: int, openness: Optional[float]) -> None:
        """Opens or closes a portal for all listeners from the next commit.

        `openness`, 0 to 1, is the share of power that is left of reflections that came through it;
        None: its movable parts open and close it, as they did before it was set.
        """
        self._call("clamor_set_portal", self._number(number, "portals"),
                   native.CLAMOR_PORTAL_BY_PARTS if openness is None else
                   given.number(openness, "openness", 0, 1))

    def part(self, number: int) -> "LevelPart":
        """The movable part number `number`, below info.parts."""
        return LevelPart(self, self._call("clamor_get_level_part", self._number(number, "parts")))

    def find_part(self, name: str) -> "LevelPart":
        """The first movable part with this name. Raises ClamorError if there is none."""
        return LevelPart(self, self._call("clamor_find_part", _name(name)))


class LevelPart(_InContext):
    """A door, a lift or a barrier of a level, which lives as long as the level.

    It hides what is behind it, per band, wherever it is. Changes take effect with the next
    Context.commit().
    """

    def __init__(self, level: Level, handle: int):
        self.context, self._level, self._handle = level.context, level, handle

    @property
    def info(self) -> PartInfo:
        """Its name, number of triangles and last pose, and whether it is enabled."""
        info = self._call("clamor_get_part_info")
        return information_of(PartInfo, info, is_enabled=not info.is_disabled)

    def move(self, pose: Any) -> None:
        """Turns and moves it about its pivot: a Pose, or a position (3,) in metres, not turned."""
        self._call("clamor_move_part", _pose(pose, given.MAX_PLACE_M))

    def enable(self, is_enabled: bool) -> None:
        """A part that is not enabled hides nothing."""
        self._call("clamor_enable_part", given.flag(is_enabled, "is_enabled"))


class Listener(_Owned):
    """A listener in a level, whose sound you render.

    Args:
        context, level: where it is.
        pose: at first: a Pose, or a position (3,) in metres.
        output: "binaural" for headphones; "loudspeakers" in `layout`; "ambisonics" (third order,
            ACN and SN3D, 16 channels); "receivers" (two omnidirectional ones, a head's width apart);
            "none": silence, for those who mix voices().
        layout: of loudspeakers: "5.1", "7.1" or "7.1.4", as `clamor render --layout` takes it.
        sofa: path of a SOFA file for "binaural"; None: the head that the library brings.
        rate_hz: 8000 to 192000.
        voices: sources that are mixed at a time, 1 to 100 000.
        memory_bytes: for pages and sounds, which may use half of it; 0: 64 MB for pages, and what the
            level's sounds take decoded, but no more than 256 MB.
        gain: of the output, an amplitude.
        limits: keeps true peaks below -1 dBFS.
        max_block_frames: the largest block that is expected; larger ones are allowed.
        offline: keyframes wait for what they need and are for the times that next_keyframe_s()
            tells, so that the samples do not depend on the machine's speed. See render_walk().
        reports_voices: voices() may be called.
        mixing: "field": all but the loudest and the moving sources are taps of responses that are
            convolved with their sounds, cheaper for many; "voices"; "auto": a field from 4000
            voices on and for dense late sound, otherwise voices with `reports_voices`.
        late: "stored": few and strong reflections, as in the bake; "dense": spread by a field to the
            density of a room.

    Raises ClamorError for options out of range, files that cannot be read, and a full context.
    """

    def __init__(self, context: Context, level: Level, pose: Any = (0.0, 0.0, 0.0), *,
                 output: str = "binaural", layout: Optional[str] = None, sofa: Any = None,
                 rate_hz: int = 48000, voices: int = 2000, memory_bytes: int = 0,
                 gain: float = 1.0, limits: bool = False, max_block_frames: int = 1024,
                 offline: bool = False,
                 reports_voices: bool = False, mixing: str = "auto",
                 late: str = "stored"):
        given.instance(context, Context, "context")
        given.instance(level, Level, "level")
        options = native.clamor_listener_options(
            output=OUTPUTS[given.choice(output, "output", list(OUTPUTS))],
            layout=given.text(layout, "layout"), sofa=given.text(sofa, "sofa"),
            rate_hz=given.whole(rate_hz, "rate_hz", 8000, 192_000),
            max_block_frames=given.whole(max_block_frames, "max_block_frames", 1, 65_536),
            voices=given.whole(voices, "voices", 1, 100_000),
            memory_bytes=given.whole(memory_bytes, "memory_bytes", 0, (1 << 64) - 1),
            gain=_output_gain(gain), limits=given.flag(limits, "limits"),
            offline=given.flag(offline, "offline"), pose=_pose(pose),
            reports_voices=given.flag(reports_voices, "reports_voices"),
            mixing=MIXINGS[given.choice(mixing, "mixing", list(MIXINGS))],
            late=LATE_SOUNDS[given.choice(late, "late", list(LATE_SOUNDS))])
        self.rate_hz = rate_hz
        self._own(context, "clamor_destroy_listener", "clamor_create_listener", level._handle, options)
        self.channels: int = self._call("clamor_get_channels")

    def move(self, pose: Any) -> None:
        """Moves the listener to a Pose, or to a position (3,) in metres looking along -Z."""
        self._call("clamor_move_listener", _pose(pose))

    def enter(self, level: Level) -> None:
        """Crossfades to another level of the context within a tenth of a second."""
        self._call("clamor_enter_level", given.instance(level, Level, "level")._handle)

    def next_keyframe_s(self) -> Optional[float]:
        """The time of the next keyframe that an offline listener wants, or None if it wants none.

        In seconds since the listener was created. Move the listener to its pose at that time, and call
        Context.update().
        """
        wanted, time_s = self._call("clamor_next_keyframe")
        return time_s if wanted else None

    def render(self, frames: Optional[int] = None, out: Optional[np.ndarray] = None) -> np.ndarray:
        """Renders the next frames, and returns them: (frames, channels), float32, 1 at full scale.

        With `out`, a C-contiguous float32 array of that shape, the library writes them there. The
        interpreter's lock is released meanwhile. Raises ClamorError if another thread is rendering
        the listener.
        """
        if out is None:
            out = np.empty((_frames(frames), self.channels), np.float32)
        wanted = None if frames is None else _frames(frames)
        given.destination(out, (wanted, self.channels), f"({wanted or 'frames'}, {self.channels})")
        self._call("clamor_render", out.ctypes.data, len(out))
        return out

    def render_planar(self, frames: Optional[int] = None,
                      out: Optional[np.ndarray] = None) -> np.ndarray:
        """As render(), with an array for each channel: (channels, frames).

        Only the rows of `out` must be contiguous, so that it may be a part of a longer array.
        """
        if out is None:
            out = np.empty((self.channels, _frames(frames)), np.float32)
        wanted = out.shape[1:] if frames is None and isinstance(out, np.ndarray) else (frames,)
        if (not isinstance(out, np.ndarray) or out.dtype != np.float32 or
                out.shape != (self.channels, *wanted) or not out.flags.writeable or
                out.strides[1] not in (4, 0)):
            raise ValueError(f"out must be a writeable float32 array ({self.channels}, "
                             f"{'frames' if frames is None else frames}) of contiguous rows")
        rows = out.ctypes.data + out.strides[0] * np.arange(self.channels, dtype=np.uintp)
        self._call("clamor_render_planar", rows.ctypes.data, out.shape[1])
        return out

    def voices(self) -> Tuple[np.ndarray, float]:
        """The newest keyframe's voices, and its time in seconds, for mixers of your own.

        The array (n,) has the fields of clamor_voice: slot, starts, sound, level_sound, direction,
        delay_s, band_gains. Only with `reports_voices`.
        """
        found = native.clamor_voices()
        self._call("clamor_get_voices", found)
        while True:
            voices = (native.clamor_voice * max(found.count, 1))()
            found = native.clamor_voices(capacity=len(voices), voices=voices)
            self._call("clamor_get_voices", found)
            if found.count <= len(voices):
                return np.ctypeslib.as_array(voices)[:found.count], found.time_s

    @property
    def statistics(self) -> Statistics:
        """Voices, keyframes, memory, failures and sources without reflections so far."""
        return information_of(Statistics, self._call("clamor_get_listener_statistics"))


def _pose(pose: Any, limit_m: float = given.MAX_LISTENER_M) -> Any:
    position_m, orientation = pose if isinstance(pose, Pose) else (pose, (0.0, 0.0, 0.0, 1.0))
    turned = given.vector(orientation, "orientation of the pose", 1e9, 4)
    if not any(turned):
        raise ValueError("orientation of the pose must not be 0, 0, 0, 0; the identity is 0, 0, 0, 1")
    return native.clamor_pose(position_m=given.vector(position_m, "position of the pose", limit_m),
                              orientation=turned)


def _frames(frames: Any) -> int:
    if frames is None:
        raise ValueError("give frames or out")
    return given.whole(frames, "frames")


def _output_gain(gain: Any) -> float:
    if given.number(gain, "gain", 0, 1e10) == 0:
        raise ValueError("gain is 0, but must be more than 0; silence needs no listener")
    return float(gain)


def _name(name: Any) -> bytes:
    found = given.text(name, "name")
    if found is None:
        raise TypeError("name must be a string, not None")
    return found
