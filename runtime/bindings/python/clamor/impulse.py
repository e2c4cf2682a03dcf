"""Impulse responses of levels whose emitter plays an impulse."""
from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor
from typing import Any, Optional

import numpy as np

from .offline import open, render_walk
from .world import Level

_MAX_VOICES = 100_000


def impulse_responses(level: Level, places_m: Any, seconds: float = 1.0,
                      output: Optional[str] = None, threads: Optional[int] = None,
                      **options: Any) -> np.ndarray:
    """Renders the impulse responses from a level's emitter to each of a list of places.

    The level has one emitter, which plays an impulse once:
    `level.add_emitter(level.add_sound("impulse", plays_once=True), position_m)`. What reaches a
    place is mixed from all of the bake's sources, up to 100 000; 1 is the amplitude at 1 m.

    Args:
        level: an open bake.
        places_m: (n, 3) positions in metres, or (n, 7) with quaternions x, y, z, w.
        seconds: length of each response.
        output: None: at an omnidirectional receiver. Or one of Listener: "binaural", "ambisonics"
            (third order), "loudspeakers", "receivers".
        threads: that render at a time [all cores].
        options: others of Listener, as rate_hz, sofa, layout.

    Returns (n, frames) float32, or (n, channels, frames) with `output`, with
    round(seconds * rate_hz) frames. Time 0 is when the impulse leaves the emitter. Raises ValueError
    if the level has several emitters, ClamorError if the bake cannot be read.
    """
    info = level.info
    if info.emitters != 1:
        raise ValueError(f"the level has {info.emitters} emitters; bake it with one, which plays "
                         "an impulse")
    places = np.asarray(places_m, float)
    if places.ndim != 2 or places.shape[1] not in (3, 7):
        raise ValueError(f"places_m must have the shape (n, 3) or (n, 7), not {places.shape}")
    options.setdefault("voices", max(1, min(info.sources, _MAX_VOICES)))

    def respond(part: np.ndarray) -> list:
        with open(level.source, level.name) as own:  # a level is rendered by one thread at a time
            return [render_walk(own, place, seconds, output=output or "ambisonics", **options)
                    for place in part]

    workers = max(1, min(threads or os.cpu_count() or 1, len(places)))
    with ThreadPoolExecutor(workers) as pool:
        parts = pool.map(respond, np.array_split(places, workers))
        responses = [response for part in parts for response in part]
    frames = round(seconds * options.get("rate_hz", 48000))
    if output is None:  # the first ambisonic channel is that of an omnidirectional receiver
        responses = [response[:, 0] for response in responses]
        return np.ascontiguousarray(responses, np.float32).reshape(len(places), frames)
    return np.ascontiguousarray([response.T for response in responses], np.float32)
