"""clamor_bake.h for ctypes: its constants, structures and functions under their names there.

A test compares all of them with the header.
"""
from __future__ import annotations

import ctypes
import functools
from ctypes import (CFUNCTYPE, POINTER, c_char, c_char_p, c_double, c_float, c_int32, c_uint32,
                    c_uint64, c_void_p)

from ._library import Signatures, Structure, checker, load

CLAMOR_BAKE_ABI_VERSION = 0
CLAMOR_BAKE_BANDS = 8

CLAMOR_BAKE_OK = 0
CLAMOR_BAKE_ERROR_ARGUMENT = -1
CLAMOR_BAKE_ERROR_FILE = -3
CLAMOR_BAKE_ERROR_MEMORY = -4
CLAMOR_BAKE_ERROR_INTERNAL = -8
CLAMOR_BAKE_ERROR_LEVEL = -9
CLAMOR_BAKE_ERROR_CANCELLED = -10
CLAMOR_BAKE_ERROR_WARNINGS = -11

CLAMOR_BAKE_PREPARING = 0
CLAMOR_BAKE_TRACING = 1
CLAMOR_BAKE_SORTING = 2
CLAMOR_BAKE_WRITING = 3

CLAMOR_BAKE_NOTE = 0
CLAMOR_BAKE_WARNING = 1

_floats = POINTER(c_float)


class clamor_bake_error(Structure):
    _fields_ = [("code", c_int32), ("sentence", c_char * 1020)]


class clamor_bake_level_options(Structure):
    _fields_ = [("bytes", c_uint32), ("hidden_meshes", c_uint32), ("acoustics", c_char_p),
                ("material", c_char_p), ("emitters", POINTER(c_char_p)),
                ("emitter_count", c_uint64)]


class clamor_bake_material(Structure):
    _fields_ = [("bytes", c_uint32), ("name", c_char_p), ("preset", c_char_p),
                ("absorption", _floats), ("scattering", _floats), ("phong", _floats),
                ("transmission", _floats)]


class clamor_bake_sound(Structure):
    _fields_ = [("bytes", c_uint32), ("plays_once", c_uint32), ("name", c_char_p),
                ("path", c_char_p), ("samples", _floats), ("frames", c_uint64),
                ("rate_hz", c_uint32)]


class clamor_bake_emitter(Structure):
    _fields_ = [("bytes", c_uint32), ("sound", c_uint32), ("name", c_char_p),
                ("position_m", c_double * 3), ("facing", c_double * 3), ("gain", c_double),
                ("directivity", c_double), ("directivity_bands", _floats), ("delay_s", c_double)]


class clamor_bake_air(Structure):
    _fields_ = [("bytes", c_uint32), ("temperature_c", c_double), ("humidity_percent", c_double),
                ("pressure_kpa", c_double)]


class clamor_bake_level_info(Structure):
    _fields_ = [("bytes", c_uint32), ("materials", c_uint32), ("sounds", c_uint32),
                ("emitters", c_uint32), ("triangles", c_uint64), ("low_m", c_float * 3),
                ("high_m", c_float * 3)]


class clamor_bake_progress(Structure):
    _fields_ = [("bytes", c_uint32), ("phase", c_uint32), ("fraction", c_double),
                ("photons", c_uint64), ("photons_total", c_uint64), ("photons_reused", c_uint64),
                ("bounces", c_uint64), ("escaped", c_uint64), ("bounces_per_s", c_double),
                ("error_db", c_double), ("seconds", c_double)]


ProgressFunction = CFUNCTYPE(c_int32, c_void_p, POINTER(clamor_bake_progress))
MessageFunction = CFUNCTYPE(None, c_void_p, c_uint32, c_char_p)


class clamor_bake_options(Structure):
    _fields_ = [("bytes", c_uint32), ("threads", c_uint32), ("seed", c_uint64),
                ("photons", c_uint64), ("sources", c_uint64), ("goal_error_db", c_double),
                ("goal_s", c_double), ("simplify_m", c_double), ("roulette_exponent", c_double),
                ("longest_path_s", c_double), ("memory_bytes", c_uint64),
                ("no_instances", c_uint32), ("strict", c_uint32), ("journal", c_char_p),
                ("user", c_void_p), ("progress", ProgressFunction), ("message", MessageFunction),
                ("has_early_order", c_uint32), ("early_order", c_uint32)]


class clamor_bake_report(Structure):
    _fields_ = [("bytes", c_uint32), ("warnings", c_uint32), ("sources", c_uint64),
                ("photons", c_uint64), ("photons_reused", c_uint64), ("file_bytes", c_uint64),
                ("missed_goal", c_uint32), ("error_db", c_float),
                ("t30_s", c_float * CLAMOR_BAKE_BANDS), ("t30_error_s", c_float * CLAMOR_BAKE_BANDS),
                ("seconds", c_double)]


_level = c_void_p
_error = POINTER(clamor_bake_error)

SIGNATURES: Signatures = {
    "clamor_bake_result_text": (c_char_p, [c_int32]),
    "clamor_bake_version": (c_uint32, []),
    "clamor_bake_abi_version": (c_uint32, []),
    "clamor_bake_read_level": (c_int32, [c_char_p, POINTER(clamor_bake_level_options),
                                         POINTER(c_void_p), _error]),
    "clamor_bake_create_level": (c_int32, [c_char_p, POINTER(c_void_p), _error]),
    "clamor_bake_destroy_level": (None, [_level]),
    "clamor_bake_add_material": (c_int32, [_level, POINTER(clamor_bake_material),
                                           POINTER(c_uint32), _error]),
    "clamor_bake_preset_name": (c_char_p, [c_uint32]),
    "clamor_bake_add_triangles": (c_int32, [_level, c_void_p, c_uint64, c_void_p, c_uint64,
                                            c_uint32, _error]),
    "clamor_bake_add_sound": (c_int32, [_level, POINTER(clamor_bake_sound), POINTER(c_uint32),
                                        _error]),
    "clamor_bake_add_emitter": (c_int32, [_level, POINTER(clamor_bake_emitter), _error]),
    "clamor_bake_set_air": (c_int32, [_level, POINTER(clamor_bake_air), _error]),
    "clamor_bake_get_level_info": (c_int32, [_level, POINTER(clamor_bake_level_info)]),
    "clamor_bake_to_file": (c_int32, [_level, POINTER(clamor_bake_options), c_char_p,
                                      POINTER(clamor_bake_report), _error]),
    "clamor_bake_to_memory": (c_int32, [_level, POINTER(clamor_bake_options), POINTER(c_void_p),
                                        POINTER(c_uint64), POINTER(clamor_bake_report), _error]),
    "clamor_bake_free": (None, [c_void_p]),
}


@functools.lru_cache(maxsize=None)
def library() -> ctypes.CDLL:
    """libclamor_bake, loaded at the first call."""
    return load("CLAMOR_BAKE_LIBRARY", ("libclamor_bake.so", "libclamor_bake.so.0"),
                ("clamor_bake_abi_version", CLAMOR_BAKE_ABI_VERSION), SIGNATURES)


check = checker(lambda: library().clamor_bake_result_text)
