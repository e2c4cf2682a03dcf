"""Impulse responses at a list of places."""
from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor
from ctypes import byref, c_uint64
from typing import Any, Optional

import numpy as np

from . import _interface as native
from ._interface import check, library
from ._library import frame_count
from .offline import open, render_walk
from .world import Level

_ALL_EMITTERS = 0xffffffff
_MAX_VOICES = 100_000


def _places(places_m: Any, widths: tuple) -> np.ndarray:
    places = np.ascontiguousarray(places_m, float)
    if places.ndim != 2 or places.shape[1] not in widths:
        raise ValueError("places_m must have the shape "
                         f"{' or '.join(f'(n, {width})' for width in widths)}, not {places.shape}")
    return places


def impulse_responses(level: Level, places_m: Any, seconds: float = 1.0,
                      emitter: Optional[int] = 0) -> np.ndarray:
    """Measures the response to an impulse of an emitter with an omnidirectional receiver.

    Args:
        level: an open bake, all of whose sources take part; surfaces occlude.
        places_m: (n, 3) positions of the receiver in metres.
        seconds: length of each response, from the emission on.
        emitter: its number; None: all of them together.

    Returns (n, frames) float32 at 48 kHz, with round(seconds * 48000) frames. An emitter of gain 1
    at 1 m gives one sample of 1. Takes a second for 100 000 sources and place, on all cores. Raises
    ClamorError for numbers of no emitter, and if the bake cannot be read.
    """
    places = _places(places_m, (3,))
    if emitter is not None and not isinstance(emitter, (int, np.integer)):
        raise TypeError(f"emitter must be its number or None, not {emitter!r}")
    samples = np.zeros((len(places), frame_count(seconds, 48000)), np.float32)
    if samples.size == 0:
        return samples
    whole, error = c_uint64(), native.clamor_error()
    check(library().clamor_measure_responses(
        level.context._open, level._handle, _ALL_EMITTERS if emitter is None else emitter,
        places.ctypes.data, len(places), samples.ctypes.data, samples.shape[1], byref(whole),
        byref(error)), error)
    return samples


def spatial_impulse_responses(level: Level, places_m: Any, seconds: float = 1.0,
                              output: str = "binaural", threads: Optional[int] = None,
                              **options: Any) -> np.ndarray:
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
        options: others of Listener, as rate_hz, sofa, layout.

    Returns (n, channels, frames) float32, with round(seconds * rate_hz) frames. Raises ValueError
    if the level has several emitters, ClamorError if the bake cannot be read.
    """
    places = _places(places_m, (3, 7))
    info = level.info
    if info.emitters != 1:
        raise ValueError(f"the level has {info.emitters} emitters; bake it with one, which plays "
                         "an impulse")
    options.setdefault("voices", max(1, min(info.sources, _MAX_VOICES)))

    def respond(part: np.ndarray) -> list:
        with open(level.source, level.name) as own:  # a level is rendered by one thread at a time
            return [render_walk(own, place, seconds, output=output, **options).T for place in part]

    workers = max(1, min(threads or os.cpu_count() or 1, len(places)))
    with ThreadPoolExecutor(workers) as pool:
        parts = pool.map(respond, np.array_split(places, workers))
        return np.ascontiguousarray([response for part in parts for response in part], np.float32)
