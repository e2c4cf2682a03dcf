"""Whole results at once: the sound of a walk, as a numpy array."""
from __future__ import annotations

from typing import Any, Optional

import numpy as np

from ._library import ClamorError, frame_count
from . import _interface as native
from .walk import Poses, path_of
from .world import Context, Level, Listener, Source

_BLOCK_FRAMES = 960


def open(source: Source, name: str = "the level") -> Level:
    """Opens a bake, from a path or from bytes, in a context of its own.

    Raises ClamorError if it cannot be read or is damaged.
    """
    return Context(caller_updates=True).open(source, name)


def render_walk(level: Level, poses: Poses, seconds: Optional[float] = None, times_s=None,
                **options: Any) -> np.ndarray:
    """Renders what a listener hears, with the samples of `clamor render` of the same walk.

    Args:
        level: an open bake.
        poses: a Walk; a Pose or an array (3,) or (7,) for a listener at rest; an array (n, 3) or
            (n, 7) of poses at `times_s`; or a function from the time in seconds to a Pose. Arrays
            hold positions in metres, then the quaternion x, y, z, w.
        seconds: duration [the length of the walk, or 10].
        times_s: (n,) increasing times of an array of poses, which is interpolated in between.
        options: those of Listener: output, layout, sofa, rate_hz, voices, gain, limits, ...

    Returns (frames, channels), float32, 1 at full scale, with round(seconds * rate_hz) frames.

    A level is rendered by one thread at a time; others wait. Open it several times to use several
    cores. Raises ClamorError if the bake cannot be read to its end.
    """
    pose_at, length_s = path_of(poses, times_s)
    duration_s = seconds if seconds is not None else length_s or 10
    frame_count(duration_s, 1)  # refuses what is no duration before anything is opened
    with level._offline_lock:
        if level._offline is None:  # of its own, because an update serves all listeners
            level._offline = Context(caller_updates=True)
        context = level._offline
        with context.open(level.source, level.name) as opened, \
                context.listen(opened, pose_at(0.0), offline=True, **options) as listener:
            frames = frame_count(duration_s, listener.rate_hz)
            samples = np.empty((frames, listener.channels), np.float32)
            for begin in range(0, frames, _BLOCK_FRAMES):
                _render_block(context, listener, pose_at, samples[begin:begin + _BLOCK_FRAMES])
            if listener.statistics.failures:
                raise ClamorError(native.CLAMOR_ERROR_FILE,
                                  f"{level.source if isinstance(level.source, str) else level.name}:"
                                  " a page or sound cannot be read. Copy the file again.")
    return samples


def _render_block(context: Context, listener: Listener, pose_at: Any, block: np.ndarray) -> None:
    while (time_s := listener.next_keyframe_s()) is not None:
        listener.move(pose_at(time_s))
        context.update()
    listener.render(out=block)
