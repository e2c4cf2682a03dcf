"""Contexts, levels and listeners: clamor.h with owners instead of handles."""
from __future__ import annotations

import itertools
import os
import threading
import warnings
import weakref
from ctypes import byref, c_double, c_uint32, c_uint64, c_void_p
from typing import Any, Callable, Dict, NamedTuple, Optional, Tuple, Union

import numpy as np

from . import _arguments as given
from . import _interface as native
from ._interface import check, library
from ._library import ClamorWarning
from .walk import Pose

OUTPUTS = {"binaural": native.CLAMOR_OUTPUT_BINAURAL,
           "loudspeakers": native.CLAMOR_OUTPUT_LOUDSPEAKERS,
           "ambisonics": native.CLAMOR_OUTPUT_AMBISONICS,
           "receivers": native.CLAMOR_OUTPUT_RECEIVERS,
           "none": native.CLAMOR_OUTPUT_NONE}

# A path, or the bytes of a bake.
Source = Union[str, "os.PathLike[str]", bytes, bytearray, memoryview]

# Bakes in memory and callbacks that the library uses, by the number that it gives back when it no
# longer does.
_used_by_library: Dict[int, Any] = {}
_numbers = itertools.count(1)


@native.ReleaseFunction
def _release(number: int) -> None:
    _used_by_library.pop(number, None)


class LevelInfo(NamedTuple):
    """What a level holds; `sources` counts emitters and secondary sources of all instances."""

    emitters: int
    sounds: int
    sources: int
    portals: int
    parts: int


class EmitterInfo(NamedTuple):
    """An emitter of a level: its name in glTF, the number of its sound, position and amplitude."""

    name: str
    sound: int
    position_m: Tuple[float, float, float]
    gain: float


class PortalInfo(NamedTuple):
    """A portal of a level: its name, and its rectangle, the points centre + a half_u + b half_v.

    Vectors are metres; a and b lie between -1 and 1.
    """

    name: str
    centre_m: Tuple[float, float, float]
    half_u_m: Tuple[float, float, float]
    half_v_m: Tuple[float, float, float]


class PartInfo(NamedTuple):
    """A movable part: its name in glTF or "", its triangles and the last pose that it was given."""

    name: str
    triangles: int
    pose: Pose
    is_enabled: bool


class Statistics(NamedTuple):
    """A listener's statistics, as clamor_listener_statistics tells them."""

    voices: int
    keyframes: int
    held_blocks: int
    keyframe_ms: float
    pages: int
    page_bytes: int
    sound_bytes: int
    failures: int
    unseen_sources: int


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
        logger = native.LogFunction(lambda _, sentence: tell(sentence.decode("utf-8", "replace")))
        options = native.clamor_options(
            caller_updates=given.flag(caller_updates, "caller_updates"),
            update_period_s=given.number(update_period_s, "update_period_s", 0, 0.1),
            max_sources=given.whole(max_sources, "max_sources", 1, 65_536),
            max_sounds=given.whole(max_sounds, "max_sounds", 1, 4096), log=logger)
        context, error = c_void_p(), native.clamor_error()
        check(library().clamor_create(byref(options), byref(context), byref(error)), error)
        self._pointer, self.log = context, log
        self._finalizer = weakref.finalize(self, _destroy, context, logger)

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
        check(library().clamor_commit(self._open, given.number(time_s, "time_s", -5e6, 5e6)))

    def update(self, loading_s: float = 0) -> int:
        """Makes the keyframes that listeners want now, and returns how many.

        Then it loads pages and sounds until none are requested or `loading_s` seconds have passed.
        Only with caller_updates, on one thread at a time.
        """
        made = c_uint32()
        check(library().clamor_update(self._open, given.number(loading_s, "loading_s", 0),
                                      byref(made)))
        return made.value


def _warn(sentence: str) -> None:
    warnings.warn(sentence, ClamorWarning)


def _destroy(context: c_void_p, _: Any) -> None:  # the callback lives until then
    library().clamor_destroy(context)


def _close(context: Context, function: str, handle: int) -> None:
    if context._finalizer.alive:  # a context takes all that belongs to it along
        getattr(library(), function)(context._pointer, handle)


def _bytes(source: Any) -> np.ndarray:
    """The bytes of an object, which stay its own."""
    try:
        return np.frombuffer(source, np.uint8) if len(source) else np.empty(0, np.uint8)
    except (TypeError, ValueError, BufferError):
        raise TypeError("source must be a path or the bytes of a bake, not "
                        f"{given.shown(source)}") from None


class Level(_Owner):
    """An open bake in a context. Listeners who are in it hear it on after it is closed."""

    def __init__(self, context: Context, source: Source, name: str = "the level"):
        handle, error = c_uint64(), native.clamor_error()
        given.instance(context, Context, "context")
        known_as = given.text(name, "name")
        if isinstance(source, (str, os.PathLike)):
            check(library().clamor_open_level(context._open, given.text(source, "source"), byref(handle),
                                              byref(error)), error)
        else:
            array = _bytes(source)
            number = next(_numbers)
            reader = native.clamor_reader(name=known_as, size=array.size, user=number,
                                          memory=array.ctypes.data, release=_release)
            _used_by_library[number] = array
            result = library().clamor_open_level_with(context._open, byref(reader), byref(handle),
                                                      byref(error))
            if result != native.CLAMOR_OK:
                _used_by_library.pop(number)
            check(result, error)
        self.context, self.source, self.name = context, source, name
        self._handle = handle.value
        self._finalizer = weakref.finalize(self, _close, context, "clamor_close_level", self._handle)
        self._offline: Optional[Context] = None
        self._offline_lock = threading.Lock()

    @property
    def info(self) -> LevelInfo:
        """The numbers of emitters, sounds, sources, portals and movable parts."""
        info = native.clamor_level_info()
        check(library().clamor_get_level_info(self.context._open, self._handle, byref(info)))
        return LevelInfo(info.emitters, info.sounds, info.sources, info.portals, info.parts)

    def emitter(self, number: int) -> EmitterInfo:
        """The emitter number `number`, below info.emitters."""
        info = native.clamor_emitter_info()
        given.index(number, "number", self.info.emitters, "emitters")
        check(library().clamor_get_emitter_info(self.context._open, self._handle, number,
                                                byref(info)))
        return EmitterInfo(info.name.decode(), info.sound, tuple(info.position_m), info.gain)

    def find_emitter(self, name: str) -> int:
        """The number of the first emitter with this name. Raises ClamorError if there is none."""
        number = c_uint32()
        check(library().clamor_find_emitter(self.context._open, self._handle, _name(name),
                                            byref(number)))
        return number.value

    def change_emitter(self, number: int, gain: float = 1.0, is_muted: bool = False,
                       group: Any = None) -> None:
        """Turns an emitter down, with all its reflections, for all listeners from the next commit.

        `gain` is an amplitude relative to the bake's, 0 to 1, times that of the Group.
        """
        from .sources import Group  # which needs this module

        given.index(number, "number", self.info.emitters, "emitters")
        options = native.clamor_emitter_options(is_muted=given.flag(is_muted, "is_muted"), has_gain=1,
                                                gain=given.number(gain, "gain", 0, 1),
                                                group=given.handle_of(group, Group, "group"))
        check(library().clamor_change_emitter(self.context._open, self._handle, number,
                                              byref(options)))

    def portal(self, number: int) -> PortalInfo:
        """The portal number `number`, below info.portals."""
        info = native.clamor_portal_info()
        given.index(number, "number", self.info.portals, "portals")
        check(library().clamor_get_portal_info(self.context._open, self._handle, number,
                                               byref(info)))
        return PortalInfo(info.name.decode(), tuple(info.centre_m), tuple(info.half_u_m),
                          tuple(info.half_v_m))

    def find_portal(self, name: str) -> int:
        """The number of the first portal with this name. Raises ClamorError if there is none."""
        number = c_uint32()
        check(library().clamor_find_portal(self.context._open, self._handle, _name(name),
                                           byref(number)))
        return number.value

    def set_portal(self, number: int, openness: Optional[float]) -> None:
        """Opens or closes a portal for all listeners from the next commit.

        `openness`, 0 to 1, is the share of power that is left of reflections that came through it;
        None: its movable parts open and close it, as they did before it was set.
        """
        given.index(number, "number", self.info.portals, "portals")
        share = (native.CLAMOR_PORTAL_BY_PARTS if openness is None else
                 given.number(openness, "openness", 0, 1))
        check(library().clamor_set_portal(self.context._open, self._handle, number, share))

    def part(self, number: int) -> "LevelPart":
        """The movable part number `number`, below info.parts."""
        given.index(number, "number", self.info.parts, "parts")
        handle = c_uint64()
        check(library().clamor_get_level_part(self.context._open, self._handle, number,
                                              byref(handle)))
        return LevelPart(self, handle.value)

    def find_part(self, name: str) -> "LevelPart":
        """The first movable part with this name. Raises ClamorError if there is none."""
        handle = c_uint64()
        check(library().clamor_find_part(self.context._open, self._handle, _name(name),
                                         byref(handle)))
        return LevelPart(self, handle.value)


class LevelPart:
    """A door, a lift or a barrier of a level, which lives as long as the level.

    It hides what is behind it, per band, wherever it is. Changes take effect with the next
    Context.commit().
    """

    def __init__(self, level: Level, handle: int):
        self.context, self._level, self._handle = level.context, level, handle

    @property
    def info(self) -> PartInfo:
        """Its name, number of triangles and last pose, and whether it is enabled."""
        info = native.clamor_part_info()
        check(library().clamor_get_part_info(self.context._open, self._handle, byref(info)))
        return PartInfo(info.name.decode(), info.triangles,
                        Pose(tuple(info.pose.position_m), tuple(info.pose.orientation)),
                        not info.is_disabled)

    def move(self, pose: Any) -> None:
        """Turns and moves it about its pivot: a Pose, or a position (3,) in metres, not turned."""
        moved = _pose(pose, given.MAX_PLACE_M)
        check(library().clamor_move_part(self.context._open, self._handle, byref(moved)))

    def enable(self, is_enabled: bool) -> None:
        """A part that is not enabled hides nothing."""
        check(library().clamor_enable_part(self.context._open, self._handle,
                                           given.flag(is_enabled, "is_enabled")))


class Listener(_Owner):
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

    Raises ClamorError for options out of range, files that cannot be read, and a full context.
    """

    def __init__(self, context: Context, level: Level, pose: Any = (0.0, 0.0, 0.0), *,
                 output: str = "binaural", layout: Optional[str] = None, sofa: Any = None,
                 rate_hz: int = 48000, voices: int = 2000, memory_bytes: int = 0,
                 gain: float = 1.0, limits: bool = False, max_block_frames: int = 1024,
                 offline: bool = False,
                 reports_voices: bool = False):
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
            reports_voices=given.flag(reports_voices, "reports_voices"))
        handle, error, channels = c_uint64(), native.clamor_error(), c_uint32()
        check(library().clamor_create_listener(context._open, level._handle, byref(options),
                                               byref(handle), byref(error)), error)
        self.context, self.rate_hz = context, rate_hz
        self._handle = handle.value
        self._finalizer = weakref.finalize(self, _close, context, "clamor_destroy_listener",
                                           self._handle)
        check(library().clamor_get_channels(context._open, self._handle, byref(channels)))
        self.channels: int = channels.value

    def move(self, pose: Any) -> None:
        """Moves the listener to a Pose, or to a position (3,) in metres looking along -Z."""
        check(library().clamor_move_listener(self.context._open, self._handle, byref(_pose(pose))))

    def enter(self, level: Level) -> None:
        """Crossfades to another level of the context within a tenth of a second."""
        given.instance(level, Level, "level")
        error = native.clamor_error()
        check(library().clamor_enter_level(self.context._open, self._handle, level._handle,
                                           byref(error)), error)

    def next_keyframe_s(self) -> Optional[float]:
        """The time of the next keyframe that an offline listener wants, or None if it wants none.

        In seconds since the level was entered. Move the listener to its pose at that time, and call
        Context.update().
        """
        wanted, time_s = c_uint32(), c_double()
        check(library().clamor_next_keyframe(self.context._open, self._handle, byref(wanted),
                                             byref(time_s)))
        return time_s.value if wanted.value else None

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
        check(library().clamor_render(self.context._open, self._handle, out.ctypes.data, len(out)))
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
        check(library().clamor_render_planar(self.context._open, self._handle, rows.ctypes.data,
                                             out.shape[1]))
        return out

    def voices(self) -> Tuple[np.ndarray, float]:
        """The newest keyframe's voices, and its time in seconds, for mixers of your own.

        The array (n,) has the fields of clamor_voice: slot, starts, sound, level_sound, direction,
        delay_s, band_gains. Only with `reports_voices`.
        """
        found = native.clamor_voices()
        check(library().clamor_get_voices(self.context._open, self._handle, byref(found)))
        while True:
            voices = (native.clamor_voice * max(found.count, 1))()
            found = native.clamor_voices(capacity=len(voices), voices=voices)
            check(library().clamor_get_voices(self.context._open, self._handle, byref(found)))
            if found.count <= len(voices):
                return np.ctypeslib.as_array(voices)[:found.count], found.time_s

    @property
    def statistics(self) -> Statistics:
        """Voices, keyframes, memory, failures and sources without reflections so far."""
        found = native.clamor_listener_statistics()
        check(library().clamor_get_listener_statistics(self.context._open, self._handle,
                                                       byref(found)))
        return Statistics(*(getattr(found, name) for name in Statistics._fields))


def _pose(pose: Any, limit_m: float = given.MAX_LISTENER_M) -> native.clamor_pose:
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
