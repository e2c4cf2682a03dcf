"""WAV files."""
from __future__ import annotations

import os
import struct
from typing import Union

import numpy as np

from . import _arguments as given


def write_wav(path: Union[str, "os.PathLike[str]"], samples: np.ndarray, rate_hz: int = 48000) -> None:
    """Writes samples (frames,) or (frames, channels), 1 at full scale, as a WAV file of 32-bit
    floating-point samples. Raises ValueError for other shapes and beyond 4 GB."""
    data = given.array(samples, "samples", "(frames,) or (frames, channels)", "<f4")
    given.whole(rate_hz, "rate_hz", 1, 0x7fffffff // 4)
    if data.ndim not in (1, 2) or data.nbytes > 0xffffffff - 64:
        raise ValueError("samples must have the shape (frames,) or (frames, channels), below 4 GB")
    channels = 1 if data.ndim == 1 else data.shape[1]
    header = struct.pack("<4sI4s4sIHHIIHH4sI", b"RIFF", 36 + data.nbytes, b"WAVE", b"fmt ", 16, 3,
                         channels, rate_hz, rate_hz * 4 * channels, 4 * channels, 32, b"data",
                         data.nbytes)
    with open(path, "wb") as file:
        file.write(header)
        file.write(data.data)  # without a copy
