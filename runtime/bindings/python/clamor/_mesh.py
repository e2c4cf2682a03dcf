"""Triangles of numpy arrays as the libraries take them."""
from __future__ import annotations

from typing import Any, Tuple

import numpy as np

from ._arguments import array


def mesh_arrays(vertices_m: Any, triangles: Any) -> Tuple[np.ndarray, np.ndarray]:
    """Returns vertices (n, 3) float32 and triangles (m, 3) uint32, C-contiguous.

    Without triangles, three vertices each make one. Raises TypeError for what are no numbers,
    ValueError for other shapes, places that are not finite, and numbers of no vertex.
    """
    vertices = array(vertices_m, "vertices_m", "(n, 3)", np.float32)
    if vertices.ndim != 2 or vertices.shape[1] != 3:
        raise ValueError(f"vertices_m must have the shape (n, 3), not {vertices.shape}")
    if not np.isfinite(vertices).all():
        raise ValueError("vertices_m must be finite, but vertex "
                         f"{np.argmin(np.isfinite(vertices).all(1))} is not")
    if triangles is None:
        if len(vertices) % 3:
            raise ValueError("vertices_m must have three vertices for each triangle")
        return vertices, np.arange(len(vertices), dtype=np.uint32).reshape(-1, 3)
    wide = np.asarray(triangles)
    if wide.ndim != 2 or wide.shape[1] != 3 or not np.issubdtype(wide.dtype, np.integer):
        raise ValueError(f"triangles must be whole numbers of the shape (m, 3), not "
                         f"{wide.dtype} {wide.shape}")
    if wide.size and not 0 <= wide.min() <= wide.max() < len(vertices):
        raise ValueError(f"triangles must name vertices from 0 to {len(vertices) - 1}")
    return vertices, np.ascontiguousarray(wide, np.uint32)
