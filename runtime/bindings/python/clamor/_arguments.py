"""Checks of arguments: a TypeError or ValueError whose sentence names the argument.

ctypes would wrap negative counts, and names no argument.
"""
from __future__ import annotations

import math
import numbers
import os
import sys
from ctypes import c_double
from typing import Any, Optional, Sequence, Tuple

import numpy as np

MAX_PLACE_M, MAX_LISTENER_M = 1e8, 1e9  # clamor.h: LIMITS


def shown(value: Any) -> str:
    """A value in a sentence, shortened."""
    text = " ".join(repr(value).split())
    return text if len(text) <= 60 else text[:57] + "..."


def _check_range(value: Any, name: str, low: float, high: float) -> None:
    if low <= value <= high and abs(value) <= sys.float_info.max:  # whole numbers may be beyond it
        return
    if math.isinf(high):
        wanted = "finite" if math.isinf(low) else f"a finite number from {low:g} on"
    else:
        wanted = f"from {low:.12g} to {high:.12g}"
    raise ValueError(f"{name} is {str(value)[:60]}, but must be {wanted}")


def number(value: Any, name: str, low: float = -math.inf, high: float = math.inf) -> float:
    """A finite number within a range."""
    if isinstance(value, (bool, np.bool_)) or not isinstance(value, numbers.Real):
        raise TypeError(f"{name} must be a number, not {shown(value)}")
    _check_range(value, name, low, high)
    return float(value)


def whole(value: Any, name: str, low: int = 0, high: int = 0xffffffff) -> int:
    """A whole number within a range."""
    if isinstance(value, (bool, np.bool_)) or not isinstance(value, numbers.Integral):
        raise TypeError(f"{name} must be a whole number, not {shown(value)}")
    _check_range(value, name, low, high)
    return int(value)


def index(value: Any, name: str, count: int, things: str) -> int:
    """The number of one of `count` things that a level has."""
    whole(value, name, -(1 << 63), 1 << 63)
    if not 0 <= value < count:
        has = f"{count} {things}, counted from 0" if count else f"no {things}"
        raise ValueError(f"{name} is {value}, but the level has {has}")
    return int(value)


def flag(value: Any, name: str) -> bool:
    """True or False."""
    if not isinstance(value, (bool, np.bool_)) and not (isinstance(value, int) and value in (0, 1)):
        raise TypeError(f"{name} must be True or False, not {shown(value)}")
    return bool(value)


def instance(value: Any, kinds: Any, name: str) -> Any:
    """An object of a class, or of one of several."""
    kinds = kinds if isinstance(kinds, tuple) else (kinds,)
    if not isinstance(value, kinds):
        wanted = " or a ".join(kind.__name__ for kind in kinds)
        raise TypeError(f"{name} must be a {wanted}, not {shown(value)}")
    return value


def handle_of(owner: Any, kind: Any, name: str) -> int:
    """The handle of an object of a class; 0 for None."""
    return 0 if owner is None else instance(owner, kind, name)._handle


def function(value: Any, name: str) -> Any:
    """Something to call, or None."""
    if value is not None and not callable(value):
        raise TypeError(f"{name} must be a function or None, not {shown(value)}")
    return value


def text(value: Any, name: str) -> Optional[bytes]:
    """A name or a path as the libraries take it; None stays None."""
    if value is None:
        return None
    try:
        encoded = os.fsencode(value)
    except TypeError:
        raise TypeError(f"{name} must be a string or a path, not {shown(value)}") from None
    if b"\0" in encoded:
        raise ValueError(f"{name} is {shown(value)}, but must not contain a zero byte")
    return encoded


def choice(value: Any, name: str, words: Sequence[str]) -> str:
    """One of some words."""
    if not isinstance(value, str) or value not in words:
        raise ValueError(f"{name} must be one of {', '.join(words)}, not {shown(value)}")
    return value


def array(values: Any, name: str, shape: str, kind: Any = float) -> np.ndarray:
    """A C-contiguous array of numbers: the values' own memory if they are that already."""
    try:
        given = np.asarray(values)
        if given.dtype.kind not in "iuf" and given.size:
            raise TypeError
        return np.asarray(given, kind, "C")
    except (TypeError, ValueError):
        raise TypeError(f"{name} must be numbers of the shape {shape}, not {shown(values)}") from None


def finite_array(values: Any, name: str, shape: str, limit: float = math.inf) -> np.ndarray:
    """An array() of finite numbers of at most a size."""
    numbers_ = array(values, name, shape)
    if numbers_.size and not (np.isfinite(numbers_).all() and
                              -limit <= numbers_.min() <= numbers_.max() <= limit):
        raise ValueError(f"{name} must be finite" +
                         ("" if math.isinf(limit) else f", within {limit:.12g} of 0") +
                         f", not {shown(values)}")
    return numbers_


def vector(values: Any, name: str, limit: float = math.inf, count: int = 3) -> Any:
    """That many finite numbers, as ctypes takes them."""
    numbers_ = finite_array(values, name, f"({count},)", limit)
    if numbers_.shape != (count,):
        raise ValueError(f"{name} must have {count} numbers, not the shape {numbers_.shape}")
    return (c_double * count)(*numbers_.tolist())


def bands(values: Any, name: str, low: float = 0, high: float = math.inf) -> Any:
    """A number for each band, or one for all, as ctypes takes them."""
    numbers_ = array(values, name, "() or (8,)")
    if numbers_.shape not in ((), (8,)):
        raise ValueError(f"{name} must be a number, or 8 of them, one for each band, not the shape "
                         f"{numbers_.shape}")
    for one in np.atleast_1d(numbers_).tolist():
        number(one, name, low, high)
    return (c_double * 8)(*np.broadcast_to(numbers_, 8).tolist())


def places(places_m: Any, widths: Tuple[int, ...]) -> np.ndarray:
    """Positions (n, 3), or wider; float64 that is C-contiguous is not copied."""
    shapes = " or ".join(f"(n, {width})" for width in widths)
    given = finite_array(places_m, "places_m", shapes, MAX_LISTENER_M)
    if given.ndim != 2 or given.shape[1] not in widths:
        raise ValueError(f"places_m must have the shape {shapes}, not {given.shape}")
    return given


def destination(out: Any, shape: Tuple[Optional[int], ...], words: str) -> np.ndarray:
    """An array that the library fills in place; a length of None is any."""
    fits = (isinstance(out, np.ndarray) and out.dtype == np.float32 and out.ndim == len(shape) and
            all(want in (None, have) for want, have in zip(shape, out.shape)) and
            out.flags.c_contiguous and out.flags.writeable)
    if not fits:
        found = f"{out.dtype} {out.shape}" if isinstance(out, np.ndarray) else shown(out)
        raise ValueError(f"out must be a C-contiguous, writeable float32 array {words}, not {found}")
    return out


def frame_count(seconds: Any, rate_hz: int) -> int:
    """Frames of a duration."""
    return round(number(seconds, "seconds", 0, 86_400) * rate_hz)
