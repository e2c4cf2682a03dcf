"""Impulse responses at a list of places."""
from __future__ import annotations

import os
import threading
from concurrent.futures import ThreadPoolExecutor
from typing import Any, Optional

import numpy as np

from ._arguments import destination, frame_count, index, instance, places, whole
from .offline import open, render_path
from .walk import path_of
from .world import Level, Listener

_ALL_EMITTERS = 0xffffffff
_MAX_VOICES = 100_000
_RATE_HZ = 48000


def impulse_responses(level: Level, places_m: Any, seconds: Optional[float] = None,
                      emitter: Optional[int] = 0, out: Optional[np.ndarray] = None) -> np.ndarray:
    """Measures the response to an impulse of an emitter with an omnidirectional receiver.

    Args:
        level: an open bake, all of whose sources take part; surfaces occlude.
        places_m: (n, 3) positions of the receiver in metres. The library reads a C-contiguous
            float64 array in place; others are converted.
        seconds: length of each response, from the emission on [that of `out`, or 1].
        emitter: its number; None: all of them together.
        out: C-contiguous float32 array (n, frames), a numpy.memmap for example, which the library
            fills in place; None: a new one.

    Returns `out`, (n, frames) float32 at 48 kHz, with round(seconds * 48000) frames if it is new. An
    emitter of gain 1 at 1 m gives one sample of 1. Takes a second for 100 000 sources and place, on
    all cores. Raises ClamorError if the bake cannot be read, ValueError for numbers of no emitter.
    """
    instance(level, Level, "level")
    at_m = places(places_m, (3,))
    if emitter is not None:
        index(emitter, "emitter", level.info.emitters, "emitters")
    frames = None if out is not None and seconds is None else frame_count(
        1.0 if seconds is None else seconds, _RATE_HZ)
    samples = (np.empty((len(at_m), frames or 0), np.float32) if out is None else
               destination(out, (len(at_m), frames), f"({len(at_m)}, {frames or 'frames'})"))
    if samples.size == 0:
        return samples
    level._call("clamor_measure_responses", _ALL_EMITTERS if emitter is None else int(emitter),
                at_m.ctypes.data, len(at_m), samples.ctypes.data, samples.shape[1])
    return samples


def spatial_impulse_responses(level: Level, places_m: Any, seconds: float = 1.0,
                              output: str = "binaural", threads: Optional[int] = None,
                              out: Optional[np.ndarray] = None, **options: Any) -> np.ndarray:
    """Renders impulse responses in any output format: binaural, in third-order ambisonics, ...

    The mixer renders them, so the level must have one emitter, which plays an impulse once:
    `level.add_emitter(level.add_sound("impulse", plays_once=True), position_m)`. All of the bake's
    sources are mixed, up to 100 000.

    Args:
        level: an open bake.
        places_m: (n, 3) positions of the listener in metres, or (n, 7) with quaternions x, y, z, w.
        seconds: length of each response, from the emission on.
        output: as that of Listener.
        threads: that render at a time [all cores].
        out: C-contiguous float32 array (n, channels, frames), which the library fills in place;
            None: a new one.
        options: others of Listener, as rate_hz, sofa, layout.

    Returns `out`, (n, channels, frames) float32, with round(seconds * rate_hz) frames. Raises
    ValueError if the level has several emitters, ClamorError if the bake cannot be read.
    """
    instance(level, Level, "level")
    at_m = places(places_m, (3, 7))
    frame_count(seconds, 1)
    workers = os.cpu_count() or 1 if threads is None else whole(threads, "threads", 1, 1024)
    info = level.info
    if info.emitters != 1:
        raise ValueError(f"the level has {info.emitters} emitters; bake it with one, which plays "
                         "an impulse")
    options.setdefault("voices", max(1, min(info.sources, _MAX_VOICES)))
    responses, making = out, threading.Lock()

    def planes_of(listener: Listener, i: int) -> np.ndarray:
        nonlocal responses
        shape = (len(at_m), listener.channels, frame_count(seconds, listener.rate_hz))
        with making:
            if responses is None:
                responses = np.empty(shape, np.float32)
            return destination(responses, shape, str(shape))[i]

    def respond(part: range) -> None:
        with open(level.source, level.name) as own:  # a level is rendered by one thread at a time
            for i in part:
                render_path(own, path_of(at_m[i])[0], lambda listener: planes_of(listener, i),
                            output=output, **options)

    if len(at_m) == 0:
        return np.empty((0, 0, 0), np.float32) if out is None else out
    workers = min(workers, len(at_m))
    parts = [range(begin, len(at_m), workers) for begin in range(workers)]
    with ThreadPoolExecutor(workers) as pool:
        list(pool.map(respond, parts))
    return responses
