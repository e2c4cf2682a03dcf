"""Poses, and walks: where a listener is and how its head is turned at each time."""
from __future__ import annotations

import bisect
import json
import math
import os
from typing import Callable, NamedTuple, Optional, Sequence, Tuple, Union

import numpy as np

from . import _arguments as given

Quaternion = Tuple[float, float, float, float]  # x, y, z, w


class Pose(NamedTuple):
    """A listener's position in metres and its orientation.

    The frame is that of glTF: +X right, +Y up. `orientation` is a quaternion x, y, z, w of any
    length but 0 from the head's frame to the level's; with the identity the listener looks along
    -Z.
    """

    position_m: Sequence[float]
    orientation: Quaternion = (0.0, 0.0, 0.0, 1.0)


def _times(p: Quaternion, q: Quaternion) -> Quaternion:
    (px, py, pz, pw), (qx, qy, qz, qw) = p, q
    return (pw * qx + px * qw + py * qz - pz * qy, pw * qy + py * qw + pz * qx - px * qz,
            pw * qz + pz * qw + px * qy - py * qx, pw * qw - px * qx - py * qy - pz * qz)


def orientation(yaw_rad: float, pitch_rad: float = 0, roll_rad: float = 0) -> Quaternion:
    """The quaternion x, y, z, w of a head turned by yaw (to the left), pitch (up), roll (right)."""

    for name, angle in ("yaw_rad", yaw_rad), ("pitch_rad", pitch_rad), ("roll_rad", roll_rad):
        given.number(angle, name)

    def turn(angle: float, axis: Tuple[int, int, int]) -> Quaternion:
        sine = math.sin(angle * 0.5)
        return (axis[0] * sine, axis[1] * sine, axis[2] * sine, math.cos(angle * 0.5))

    return _times(_times(turn(yaw_rad, (0, 1, 0)), turn(pitch_rad, (1, 0, 0))),
                  turn(roll_rad, (0, 0, -1)))


class Walk:
    """A listener's path: positions and angles that are linear between points.

    Args:
        times_s: (n,) times of the points in seconds, which never fall; two at one time are a jump.
        positions_m: (n, 3) positions in metres.
        yaw_deg, pitch_deg, roll_deg: (n,) angles in degrees, or one for all points. Yaw 0 looks
            along -Z and grows to the left, pitch grows upwards, roll towards the right shoulder.
            Yaw and roll take the shorter arc between points.
        loop: the path begins again at its end; else its last point holds.

    Raises ValueError if the shapes differ or the times fall.
    """

    def __init__(self, times_s, positions_m, yaw_deg=0.0, pitch_deg=0.0, roll_deg=0.0,
                 loop: bool = False):
        times = np.atleast_1d(given.finite_array(times_s, "times_s", "(n,)"))
        if times.ndim != 1 or len(times) == 0 or not np.all(np.diff(times) >= 0):
            raise ValueError("times_s must be a list of at least one time, and never fall")
        positions = given.finite_array(positions_m, "positions_m", f"({len(times)}, 3)",
                                       given.MAX_LISTENER_M)
        if positions.shape != (len(times), 3):
            raise ValueError(f"positions_m must have the shape ({len(times)}, 3), not "
                             f"{positions.shape}")
        self._times_s = times.tolist()
        self._positions_m = positions.tolist()
        degree = math.pi / 180
        self._angles_rad = []
        for name, values in ("yaw_deg", yaw_deg), ("pitch_deg", pitch_deg), ("roll_deg", roll_deg):
            angles = given.finite_array(values, name, f"() or ({len(times)},)")
            if angles.shape not in ((), times.shape):
                raise ValueError(f"{name} must be a number, or {len(times)} of them, not the shape "
                                 f"{angles.shape}")
            self._angles_rad.append([float(angle) * degree
                                     for angle in np.broadcast_to(angles, times.shape)])
        self.loop = given.flag(loop, "loop")

    @classmethod
    def read(cls, path: Union[str, "os.PathLike[str]"]) -> "Walk":
        """Reads a walk file, as `clamor render --walk` takes it."""
        with open(given.instance(path, (str, os.PathLike), "path"), encoding="utf-8") as file:
            text = file.read()
        try:
            walk = json.loads(text)
            points = walk["points"]
            return cls([point["time_s"] for point in points],
                       [point["position_m"] for point in points],
                       *([point.get(angle, 0.0) for point in points]
                         for angle in ("yaw_deg", "pitch_deg", "roll_deg")),
                       loop=walk.get("loop", False))
        except (KeyError, TypeError, AttributeError, ValueError) as error:
            what = f"{error} is missing" if isinstance(error, KeyError) else error
            raise ValueError(f"{path}: is no walk: {what}") from None

    @property
    def length_s(self) -> float:
        """The time of the last point in seconds."""
        return self._times_s[-1]

    def __call__(self, time_s: float) -> Pose:
        """The pose at a time, to the last bit as the program `clamor` computes it."""
        times, time_s = self._times_s, given.number(time_s, "time_s")
        if self.loop and self.length_s > 0:
            time_s = math.fmod(max(time_s, 0.0), self.length_s)
        after = bisect.bisect_right(times, time_s)
        if after == 0 or after == len(times):
            at = min(after, len(times) - 1)
            return Pose(self._positions_m[at], orientation(*(a[at] for a in self._angles_rad)))
        a, b = after - 1, after
        t = (time_s - times[a]) / (times[b] - times[a])
        yaw, pitch, roll = self._angles_rad

        def shorter_arc(angles) -> float:
            return angles[a] + t * math.remainder(angles[b] - angles[a], 2 * math.pi)

        return Pose([p + t * (q - p) for p, q in zip(self._positions_m[a], self._positions_m[b])],
                    orientation(shorter_arc(yaw), pitch[a] + t * (pitch[b] - pitch[a]),
                                shorter_arc(roll)))


class _SampledPoses:
    """Poses at given times: positions are linear and orientations turn evenly in between."""

    def __init__(self, poses: np.ndarray, times_s: np.ndarray):
        self._poses, self._times_s = poses, times_s

    def __call__(self, time_s: float) -> Pose:
        t = np.interp(time_s, self._times_s, np.arange(len(self._times_s)))
        a = int(t)
        b, t = min(a + 1, len(self._poses) - 1), t - a
        one, two = self._poses[a], self._poses[b]
        if len(one) == 3:
            return Pose((one + t * (two - one)).tolist())
        p, q = one[3:] / np.linalg.norm(one[3:]), two[3:] / np.linalg.norm(two[3:])
        cosine = float(np.dot(p, q))
        if cosine < 0:
            q, cosine = -q, -cosine
        angle = math.acos(min(cosine, 1.0))
        weights = ((1 - t, t) if angle < 1e-6 else
                   (math.sin((1 - t) * angle) / math.sin(angle), math.sin(t * angle) / math.sin(angle)))
        return Pose((one[:3] + t * (two[:3] - one[:3])).tolist(),
                    tuple((weights[0] * p + weights[1] * q).tolist()))


Poses = Union[Walk, Pose, Sequence[float], np.ndarray, Callable[[float], Pose]]


def path_of(poses: Poses, times_s=None) -> Tuple[Callable[[float], Pose], Optional[float]]:
    """Returns the function from time to pose, and the walk's length in seconds if it has one."""
    if isinstance(poses, Pose) or callable(poses):
        _refuse_times(times_s)
        if isinstance(poses, Pose):
            return lambda time_s: poses, None
        return poses, poses.length_s or None if isinstance(poses, Walk) else None
    array = given.finite_array(poses, "poses", "(3,), (7,), (n, 3) or (n, 7), or a Walk, a Pose or a "
                               "function of time", given.MAX_LISTENER_M)
    if array.ndim == 0 or array.ndim > 2 or array.shape[-1] not in (3, 7) or array.size == 0:
        raise ValueError("poses must be a Walk, a Pose, a function of time, or an array of the "
                         f"shape (3,), (7,), (n, 3) or (n, 7), not {array.shape}")
    if array.ndim == 1:
        _refuse_times(times_s)
        pose = Pose(array[:3].tolist(), tuple(array[3:].tolist()) or Pose._field_defaults["orientation"])
        return lambda time_s: pose, None
    times = None if times_s is None else given.finite_array(times_s, "times_s", "(n,)")
    if times is None or times.shape != array.shape[:1] or not np.all(np.diff(times) > 0):
        raise ValueError(f"{len(array)} poses need times_s, {len(array)} increasing times")
    return _SampledPoses(array, times), float(times[-1]) or None


def _refuse_times(times_s: object) -> None:
    if times_s is not None:
        raise ValueError("times_s are for an array of poses (n, 3) or (n, 7)")
