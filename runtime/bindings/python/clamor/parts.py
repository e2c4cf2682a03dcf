"""Movable parts of the application's own: doors, lifts and barriers that it adds to a level."""
from __future__ import annotations

from typing import Any, Optional, Sequence

from . import _arguments as given
from ._library import runtime as native
from ._mesh import mesh_arrays
from .world import Context, Level, LevelPart, _Owned, _pose


class Part(_Owned, LevelPart):
    """A box or a mesh that occludes and reflects, per band, wherever you move it.

    Args:
        context: whose listeners it hides sound from, from the next Context.commit() on.
        half_extents_m: (3,) of a box about its pivot, each 0.001 to 10 000. A box has two surfaces
            on each path through it.
        vertices_m: (n, 3) of a mesh, relative to its pivot; instead of a box.
        triangles: (m, 3) numbers of vertices; None: three vertices each make one.
        pose: at first: a Pose, or a position (3,) in metres.
        level: the Level whose listeners alone hear it; None: those of all levels.
        transmission: share of the power that passes a surface, 0 to 1, a number or (8,) for 63 Hz
            to 8 kHz.
        absorption: share of the power that is not reflected, likewise, at least the transmission.
            All 0: 0.1, or the transmission where that is more. 1: it reflects nothing.
        scattering: share of the rest that is not reflected as by a mirror, likewise.
        is_enabled: a part that is not hides nothing.

    close(), or losing the object, removes it with the next commit. Raises ValueError for numbers out
    of range and other shapes, ClamorError for a full context (4096 parts).
    """

    def __init__(self, context: Context, half_extents_m: Optional[Sequence[float]] = None, *,
                 vertices_m: Any = None, triangles: Any = None, pose: Any = (0.0, 0.0, 0.0),
                 level: Optional[Level] = None, transmission: Any = 0.0, absorption: Any = 0.0,
                 scattering: Any = 0.0, is_enabled: bool = True):
        if (half_extents_m is None) == (vertices_m is None):
            raise ValueError("a part is a box or a mesh: give half_extents_m or vertices_m")

        given.instance(context, Context, "context")
        options = native.clamor_part_options(
            is_disabled=not given.flag(is_enabled, "is_enabled"),
            level=given.handle_of(level, Level, "level"), pose=_pose(pose, given.MAX_PLACE_M),
            transmission=given.bands(transmission, "transmission", 0, 1),
            absorption=given.bands(absorption, "absorption", 0, 1),
            scattering=given.bands(scattering, "scattering", 0, 1))
        if half_extents_m is not None:
            options.half_extents_m = given.vector(half_extents_m, "half_extents_m", 10_000)
            if min(options.half_extents_m) < 0.001:
                raise ValueError("half_extents_m must be from 0.001 to 10000 each, not "
                                 f"{given.shown(half_extents_m)}")
        else:
            vertices, corners = mesh_arrays(vertices_m, triangles)  # the library copies them
            options.vertices_m, options.vertices = vertices.ctypes.data, len(vertices)
            options.indices, options.triangles = corners.ctypes.data, len(corners)
        self._own(context, "clamor_remove_part", "clamor_add_part", options)
