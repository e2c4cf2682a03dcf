"""Bakes: clamor_bake.h with numpy arrays."""
from __future__ import annotations

import ctypes
import itertools
import os
import weakref
from ctypes import c_char_p, c_void_p
from typing import Any, Callable, List, NamedTuple, Optional, Sequence, Tuple, Union

import numpy as np

from . import _arguments as given
from ._library import ClamorError
from ._library import bake as native
from ._mesh import mesh_arrays
from .information import information_of
from .world import _Owner

Path = Union[str, "os.PathLike[str]"]
PHASES = ("preparing", "tracing", "sorting", "writing")
BANDS_HZ = (63, 125, 250, 500, 1000, 2000, 4000, 8000)


class BakeProgress(NamedTuple):
    """How far a bake is; `phase` is one of PHASES, `fraction` the share of the photons done."""

    phase: str
    fraction: float
    photons: int
    photons_total: int
    error_db: float
    seconds: float


class BakeReport(NamedTuple):
    """What a bake came to. `t30_s` are decay times in seconds for each of BANDS_HZ, (8,); 0 where
    none was measured. `messages` are the sentences of notes and warnings."""

    sources: int
    photons: int
    photons_reused: int
    file_bytes: int
    error_db: float
    missed_goal: bool
    t30_s: np.ndarray
    t30_error_s: np.ndarray
    seconds: float
    messages: List[str]
    warnings: List[str]


def presets() -> List[str]:
    """The names of the material presets."""
    names = map(native.library.clamor_bake_preset_name, itertools.count())
    return [name.decode() for name in itertools.takewhile(bool, names)]


def _bands(values: Any, name: str) -> Optional[np.ndarray]:
    if values is None:
        return None
    array = given.array(values, name, "() or (8,)", np.float32)
    if array.shape not in ((), (native.CLAMOR_BAKE_BANDS,)):
        raise ValueError(f"{name} must be a number or {native.CLAMOR_BAKE_BANDS} of them, one for "
                         f"each band, not {array.shape}")
    if not np.isfinite(array).all() or not np.all(array >= 0):
        raise ValueError(f"{name} must be finite and not negative, not {given.shown(values)}")
    return np.ascontiguousarray(np.broadcast_to(array, native.CLAMOR_BAKE_BANDS))


def _address(array: Optional[np.ndarray]) -> Optional[int]:
    return None if array is None else array.ctypes.data


class BakeLevel(_Owner):
    """Triangles, materials, sounds and emitters: a level to bake.

    Args:
        path: a .gltf or .glb file, with its sidecar and sounds; None: an empty level.
        name: of an empty level; the bake tells it.
        acoustics: path of the sidecar [PATH.acoustics.json, if it exists].
        material: preset for materials without acoustic data [plaster].
        emitters: more of them, as "name=violin,signal=violin.flac,at=1,1.2,-3".
        hidden_meshes: also the meshes that the level marks as hidden.

    Raises ClamorError if a file cannot be read.
    """

    def __init__(self, path: Optional[Path] = None, *, name: Optional[str] = None,
                 acoustics: Optional[Path] = None, material: Optional[str] = None,
                 emitters: Sequence[str] = (), hidden_meshes: bool = False):
        if path is None:
            level = native.call("clamor_bake_create_level", given.text(name, "name"))
        else:
            if isinstance(emitters, str):
                raise TypeError("emitters must be a list of strings, not one string")
            fields = [given.text(one, "emitters") for one in emitters]
            texts = (c_char_p * len(fields))(*fields)
            options = native.clamor_bake_level_options(
                hidden_meshes=given.flag(hidden_meshes, "hidden_meshes"),
                acoustics=given.text(acoustics, "acoustics"),
                material=given.text(material, "material"),
                emitters=ctypes.addressof(texts) if fields else None, emitter_count=len(fields))
            level = native.call("clamor_bake_read_level", given.text(path, "path"), options)
        self._pointer = c_void_p(level)
        self._finalizer = weakref.finalize(self, native.library.clamor_bake_destroy_level,
                                           self._pointer)

    @property
    def _open(self) -> c_void_p:
        if not self._finalizer.alive:
            raise ValueError("the level is closed")
        return self._pointer

    def _call(self, function: str, *arguments: Any) -> Any:
        return native.call(function, self._open, *arguments)

    def add_material(self, preset: Optional[str] = None, *, name: Optional[str] = None,
                     absorption: Any = None, scattering: Any = None, phong: Any = None,
                     transmission: Any = None) -> int:
        """Adds a material and returns its number.

        Values are a number, or (8,) for BANDS_HZ; without a preset, `absorption` must be given.
        absorption: share of the incident power that is not reflected, 0 to 1. scattering: share of
        the reflected power that is diffuse, 0 to 1. phong: exponent of the specular lobe, 0 to
        1000. transmission: share of the incident power, at most the absorption. None is the
        preset's. Raises ClamorError for values above their range and unknown presets.
        """
        bands = {key: _bands(values, key)
                 for key, values in (("absorption", absorption), ("scattering", scattering),
                                     ("phong", phong), ("transmission", transmission))}
        values = native.clamor_bake_material(name=given.text(name, "name"),
                                             preset=given.text(preset, "preset"),
                                             **{key: _address(a) for key, a in bands.items()})
        return self._call("clamor_bake_add_material", values)

    def add_triangles(self, vertices_m: Any, triangles: Any, material: int) -> None:
        """Adds triangles, which reflect on both sides.

        vertices_m: (n, 3) positions in metres. triangles: (m, 3) numbers of vertices, or None for
        the vertices in their order. material: what add_material() returned.
        Raises ClamorError for numbers of no vertex or material, ValueError for other shapes.
        """
        vertices, corners = mesh_arrays(vertices_m, triangles)
        self._call("clamor_bake_add_triangles", vertices.ctypes.data, len(vertices),
                   corners.ctypes.data, len(corners), given.whole(material, "material"))

    def add_box(self, low_m: Sequence[float], high_m: Sequence[float], material: int) -> None:
        """Adds the twelve triangles of a box between two corners in metres: a shoebox room."""
        low_m, high_m = given.vector(low_m, "low_m"), given.vector(high_m, "high_m")
        corners = np.array([[(high_m if i >> axis & 1 else low_m)[axis] for axis in range(3)]
                            for i in range(8)], np.float32)
        sides = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
        triangles = [(a, b, c) for a, b, c, d in sides] + [(a, c, d) for a, b, c, d in sides]
        self.add_triangles(corners, triangles, material)

    def add_sound(self, sound: Union[Path, np.ndarray], rate_hz: int = 48000, *,
                  name: Optional[str] = None, plays_once: bool = False) -> int:
        """Adds a sound and returns its number.

        sound: a file's path, "noise" (pink), "impulse", or mono samples (frames,), 1 at full scale,
        which are resampled from rate_hz to 48 kHz. plays_once: it does not loop.
        Raises ClamorError if the file cannot be read.
        """
        values = native.clamor_bake_sound(name=given.text(name, "name"),
                                          plays_once=given.flag(plays_once, "plays_once"))
        if isinstance(sound, (str, os.PathLike)):
            values.path = given.text(sound, "sound")
        else:
            samples = given.array(sound, "sound", "(frames,)", np.float32)
            if samples.ndim != 1:
                raise ValueError(f"sound must have the shape (frames,), not {samples.shape}")
            values.samples, values.frames = samples.ctypes.data, len(samples)
            values.rate_hz = given.whole(rate_hz, "rate_hz", 1000, 768_000)
        return self._call("clamor_bake_add_sound", values)

    def add_emitter(self, sound: int, position_m: Sequence[float], *, name: Optional[str] = None,
                    facing: Sequence[float] = (0, 0, -1), gain: float = 1.0,
                    directivity: Any = 0.0, delay_s: float = 0.0) -> None:
        """Adds an emitter at a position (3,) in metres that plays a sound.

        gain: amplitude at 1 m on the axis `facing`. directivity: exponent p of the intensity
        ((1 + cos a) / 2)^p at an angle a to the axis, a number or (8,) for BANDS_HZ: 0 is
        omnidirectional, 1 a cardioid. delay_s: the sound's start.
        """
        bands = None if np.ndim(directivity) == 0 else _bands(directivity, "directivity")
        self._call("clamor_bake_add_emitter", native.clamor_bake_emitter(
            sound=given.whole(sound, "sound"), name=given.text(name, "name"),
            position_m=given.vector(position_m, "position_m"), facing=given.vector(facing, "facing"),
            gain=given.number(gain, "gain", 0),
            directivity=given.number(directivity, "directivity", 0) if bands is None else 0,
            directivity_bands=_address(bands), delay_s=given.number(delay_s, "delay_s", 0)))

    def set_air(self, temperature_c: float = 20, humidity_percent: float = 50,
                pressure_kpa: float = 101.325) -> None:
        """Sets the air, which absorbs sound and determines its speed."""
        self._call("clamor_bake_set_air", native.clamor_bake_air(
            temperature_c=given.number(temperature_c, "temperature_c"),
            humidity_percent=given.number(humidity_percent, "humidity_percent"),
            pressure_kpa=given.number(pressure_kpa, "pressure_kpa")))

    def bake(self, path: Optional[Path] = None, **options: Any) -> Any:
        """Bakes the level; the options are those of bake(), and so is what it returns."""
        return bake(self, path, **options)


def bake(level: Union[BakeLevel, Path], path: Optional[Path] = None, *, threads: int = 0,
         seed: int = 0, photons: int = 0, sources: int = 0, goal_error_db: float = 0,
         goal_s: float = 0, simplify_m: float = 0, roulette_exponent: float = 0,
         longest_path_s: float = 0, memory_bytes: int = 0, instances: bool = True,
         strict: bool = False, journal: Optional[Path] = None, early_order: Optional[int] = None,
         probe_spacing_m: float = 0, progress: Optional[Callable[[BakeProgress], Any]] = None) -> Any:
    """Bakes a level, with the bytes of `clamor bake` of the same level and options.

    Args:
        level: a BakeLevel, or the path of a .gltf or .glb file.
        path: of the bake file; None: returns its bytes, which open() takes.
        threads: does not change the bake. 0, here and below, is the default: all cores.
        seed, photons, sources: of the random numbers; to trace; secondary sources to keep at most.
        goal_error_db, goal_s: instead: until the energy decay is known this well, or for so long.
        simplify_m: removes triangles and moves no surface further than this.
        roulette_exponent, longest_path_s, memory_bytes, instances, strict, journal: as in
            clamor_bake.h.
        early_order: reflections by mirrors that are image sources, 0 to 3; None: 3 for up to 16
            emitters, and 0 for more than 256.
        probe_spacing_m: metres between places where moving sources are heard with reflections, or
            -1 for as many as suit the level.
        progress: called about ten times a second with a BakeProgress on the calling thread. If it
            returns False or raises, the bake is cancelled; what it raised is raised again.

    Returns a BakeReport, or the pair (bytes, BakeReport) without `path`. Raises ClamorError if the
    level cannot be baked, or the bake was cancelled.
    """
    counts = dict(seed=seed, photons=photons, sources=sources, memory_bytes=memory_bytes)
    sizes = dict(goal_error_db=goal_error_db, goal_s=goal_s, simplify_m=simplify_m,
                 roulette_exponent=roulette_exponent, longest_path_s=longest_path_s)
    settings = dict(threads=given.whole(threads, "threads", 0, 1024),
                    no_instances=not given.flag(instances, "instances"),
                    strict=given.flag(strict, "strict"), journal=given.text(journal, "journal"),
                    has_early_order=early_order is not None,
                    early_order=0 if early_order is None else
                    given.whole(early_order, "early_order", 0, 3),
                    probe_spacing_m=given.number(probe_spacing_m, "probe_spacing_m", -1),
                    **{name: given.whole(value, name, 0, (1 << 64) - 1)
                       for name, value in counts.items()},
                    **{name: given.number(value, name, 0) for name, value in sizes.items()})
    given.function(progress, "progress")
    if isinstance(level, BakeLevel):
        return _run(level, path, settings, progress)
    with BakeLevel(level) as read:
        return _run(read, path, settings, progress)


def _run(level: BakeLevel, path: Optional[Path], settings: dict,
         progress: Optional[Callable[[BakeProgress], Any]]) -> Any:
    notes: List[str] = []
    warnings: List[str] = []
    raised: List[BaseException] = []

    def report_progress(_: Any, pointer: Any) -> int:
        if progress is None:
            return 0
        try:
            now = pointer.contents
            told = information_of(BakeProgress, now, phase=PHASES[now.phase])
            return int(progress(told) is False)
        except BaseException as exception:  # no exception can pass through the library
            raised.append(exception)
            return 1

    def keep_message(_: Any, kind: int, sentence: bytes) -> None:
        (warnings if kind == native.CLAMOR_BAKE_WARNING else notes).append(
            sentence.decode("utf-8", "replace"))

    options = native.clamor_bake_options(
        progress=native.clamor_bake_options_progress(report_progress),
        message=native.clamor_bake_options_message(keep_message), **settings)
    baked, count = None, 0
    try:
        if path is None:
            baked, count, report = level._call("clamor_bake_to_memory", options)
        else:
            report = level._call("clamor_bake_to_file", options, given.text(path, "path"))
        if raised:
            raise raised[0]
        told = information_of(BakeReport, report, missed_goal=bool(report.missed_goal),
                              messages=notes, warnings=warnings, t30_s=np.array(report.t30_s),
                              t30_error_s=np.array(report.t30_error_s))
        return told if path is not None else (ctypes.string_at(baked, count), told)
    except ClamorError:
        if raised:
            raise raised[0] from None
        raise
    finally:
        native.library.clamor_bake_free(baked)
