"""What the library says of levels, emitters, portals, parts and listeners, as named tuples."""
from __future__ import annotations

from ctypes import Array
from typing import Any, NamedTuple, Tuple

from ._library import runtime as native
from .walk import Pose


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


def information_of(kind: Any, info: Any, **others: Any) -> Any:
    """A named tuple of those members of a structure that it has, and of others."""

    def value(member: Any) -> Any:
        if isinstance(member, native.clamor_pose):
            return Pose(tuple(member.position_m), tuple(member.orientation))
        if isinstance(member, Array):
            return tuple(member)
        return member.decode() if isinstance(member, bytes) else member

    return kind(*(others[name] if name in others else value(getattr(info, name))
                  for name in kind._fields))
