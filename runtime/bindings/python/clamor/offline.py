"""Whole results at once: the sound of a walk, as a numpy array."""
from __future__ import annotations

from typing import Any, Callable, Optional

import numpy as np

from ._arguments import destination, frame_count, instance
from ._library import ClamorError
from ._library import runtime as native
from .walk import Pose, Poses, path_of
from .world import Context, Level, Listener, Source

_BLOCK_FRAMES = 960


def open(source: Source, name: str = "the level") -> Level:
    """Opens a bake, from a path or from bytes, in a context of its own.

    Raises ClamorError if it cannot be read or is damaged.
    """
    return Context(caller_updates=True).open(source, name)


def render_walk(level: Level, poses: Poses, seconds: Optional[float] = None, times_s=None,
                out: Optional[np.ndarray] = None, **options: Any) -> np.ndarray:
    """Renders what a listener hears, with the samples of `clamor render` of the same walk.

    Args:
        level: an open bake.
        poses: a Walk; a Pose or an array (3,) or (7,) for a listener at rest; an array (n, 3) or
            (n, 7) of poses at `times_s`; or a function from the time in seconds to a Pose. Arrays
            hold positions in metres, then the quaternion x, y, z, w.
        seconds: duration [that of `out`, the length of the walk, or 10].
        times_s: (n,) increasing times of an array of poses, which is interpolated in between.
        out: C-contiguous float32 array (frames, channels), which the library fills in place; None:
            a new one.
        options: those of Listener: output, layout, sofa, rate_hz, voices, gain, limits, ...

    Returns `out`, (frames, channels), float32, 1 at full scale, with round(seconds * rate_hz) frames
    if it is new.

    A level is rendered by one thread at a time; others wait. Open it several times to use several
    cores. Raises ClamorError if the bake cannot be read to its end.
    """
    instance(level, Level, "level")
    pose_at, length_s = path_of(poses, times_s)
    duration_s = seconds if seconds is not None else length_s or 10
    frame_count(duration_s, 1)  # refuses what is no duration before anything is opened

    def planes_of(listener: Listener) -> np.ndarray:
        frames = frame_count(duration_s, listener.rate_hz)
        if out is None:
            return np.empty((frames, listener.channels), np.float32).T
        wanted = None if seconds is None else frames
        return destination(out, (wanted, listener.channels),
                           f"({'frames' if wanted is None else wanted}, {listener.channels})").T

    planes = render_path(level, pose_at, planes_of, **options)
    return planes.T if out is None else out


def render_path(level: Level, pose_at: Callable[[float], Pose],
                planes_of: Callable[[Listener], np.ndarray], **options: Any) -> np.ndarray:
    """Renders into planes_of(listener), an array (channels, frames), and returns that.

    The planes, or the transposed array, are contiguous.
    """
    with level._offline_lock:
        if level._offline is None:  # of its own, because an update serves all listeners
            level._offline = Context(caller_updates=True, log=level.context.log)
        context = level._offline
        with context.open(level.source, level.name) as opened, \
                context.listen(opened, pose_at(0.0), offline=True, **options) as listener:
            planes = planes_of(listener)
            render = (listener.render_planar if planes.flags.c_contiguous else
                      lambda out: listener.render(out=out.T))
            for begin in range(0, planes.shape[1], _BLOCK_FRAMES):
                while (time_s := listener.next_keyframe_s()) is not None:
                    listener.move(pose_at(time_s))
                    context.update()
                render(out=planes[:, begin:begin + _BLOCK_FRAMES])
            if listener.statistics.failures:
                raise ClamorError(native.CLAMOR_ERROR_FILE,
                                  f"{level.source if isinstance(level.source, str) else level.name}:"
                                  " a page or sound cannot be read. Copy the file again.")
    return planes
