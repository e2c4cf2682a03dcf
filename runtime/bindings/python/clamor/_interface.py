"""clamor.h for ctypes: its constants, structures and functions under their names there.

A test compares all of them with the header.
"""
from __future__ import annotations

import ctypes
import functools
from ctypes import (CFUNCTYPE, POINTER, c_char, c_char_p, c_double, c_float, c_int32, c_uint32,
                    c_uint64, c_void_p)

from ._library import Signatures, Structure, checker, load

CLAMOR_ABI_VERSION = 0

CLAMOR_OK = 0
CLAMOR_ERROR_ARGUMENT = -1
CLAMOR_ERROR_HANDLE = -2
CLAMOR_ERROR_FILE = -3
CLAMOR_ERROR_MEMORY = -4
CLAMOR_ERROR_FULL = -5
CLAMOR_ERROR_BUSY = -6
CLAMOR_ERROR_STATE = -7
CLAMOR_ERROR_INTERNAL = -8
CLAMOR_ERROR_NOT_FOUND = -12

CLAMOR_PORTAL_BY_PARTS = -1.0

CLAMOR_OUTPUT_BINAURAL = 0
CLAMOR_OUTPUT_LOUDSPEAKERS = 1
CLAMOR_OUTPUT_AMBISONICS = 2
CLAMOR_OUTPUT_RECEIVERS = 3
CLAMOR_OUTPUT_NONE = 4

ReadFunction = CFUNCTYPE(c_int32, c_void_p, c_uint64, c_uint64, c_void_p)
ReleaseFunction = CFUNCTYPE(None, c_void_p)
LogFunction = CFUNCTYPE(None, c_void_p, c_char_p)
PullFunction = CFUNCTYPE(c_uint32, c_void_p, POINTER(c_float), c_uint32)


class clamor_error(Structure):
    _fields_ = [("code", c_int32), ("sentence", c_char * 508)]


class clamor_options(Structure):
    _fields_ = [("bytes", c_uint32), ("caller_updates", c_uint32), ("update_period_s", c_double),
                ("max_sources", c_uint32), ("max_sounds", c_uint32), ("user", c_void_p),
                ("log", LogFunction), ("thread_begins", LogFunction), ("thread_ends", LogFunction)]


class clamor_reader(Structure):
    _fields_ = [("bytes", c_uint32), ("name", c_char_p), ("size", c_uint64), ("user", c_void_p),
                ("read", ReadFunction), ("memory", c_void_p), ("release", ReleaseFunction)]


class clamor_level_info(Structure):
    _fields_ = [("bytes", c_uint32), ("emitters", c_uint32), ("sounds", c_uint32),
                ("portals", c_uint32), ("sources", c_uint64), ("parts", c_uint32)]


class clamor_emitter_info(Structure):
    _fields_ = [("bytes", c_uint32), ("sound", c_uint32), ("position_m", c_double * 3),
                ("gain", c_double), ("name", c_char_p)]


class clamor_portal_info(Structure):
    _fields_ = [("bytes", c_uint32), ("centre_m", c_double * 3), ("half_u_m", c_double * 3),
                ("half_v_m", c_double * 3), ("name", c_char_p)]


class clamor_pose(Structure):
    _fields_ = [("position_m", c_double * 3), ("orientation", c_double * 4)]


class clamor_listener_options(Structure):
    _fields_ = [("bytes", c_uint32), ("output", c_uint32), ("layout", c_char_p),
                ("sofa", c_char_p), ("rate_hz", c_uint32), ("max_block_frames", c_uint32),
                ("voices", c_uint32), ("memory_bytes", c_uint64), ("gain", c_double),
                ("limits", c_uint32), ("offline", c_uint32), ("pose", clamor_pose),
                ("reports_voices", c_uint32)]


class clamor_listener_statistics(Structure):
    _fields_ = [("bytes", c_uint32), ("voices", c_uint32), ("keyframes", c_uint64),
                ("held_blocks", c_uint64), ("keyframe_ms", c_double), ("pages", c_uint64),
                ("page_bytes", c_uint64), ("sound_bytes", c_uint64), ("failures", c_uint64),
                ("unseen_sources", c_uint32)]


class clamor_sound_options(Structure):
    _fields_ = [("bytes", c_uint32), ("rate_hz", c_uint32), ("loops", c_uint32)]


class clamor_stream(Structure):
    _fields_ = [("bytes", c_uint32), ("rate_hz", c_uint32), ("user", c_void_p),
                ("pull", PullFunction), ("release", ReleaseFunction)]


class clamor_group_options(Structure):
    _fields_ = [("bytes", c_uint32), ("is_muted", c_uint32), ("is_paused", c_uint32),
                ("has_gain", c_uint32), ("gain", c_double), ("max_voices", c_double)]


class clamor_motion(Structure):
    _fields_ = [("position_m", c_double * 3), ("velocity_mps", c_double * 3),
                ("axis", c_double * 3)]


class clamor_source_options(Structure):
    _fields_ = [("bytes", c_uint32), ("ends_with_sound", c_uint32), ("sound", c_uint64),
                ("group", c_uint64), ("level", c_uint64), ("motion", clamor_motion),
                ("gain", c_double), ("band_gains", c_double * 8), ("directivity", c_double * 8),
                ("played_s", c_double), ("has_reverberation", c_uint32),
                ("reverberation", c_double)]


class clamor_emitter_options(Structure):
    _fields_ = [("bytes", c_uint32), ("is_muted", c_uint32), ("has_gain", c_uint32),
                ("group", c_uint64), ("gain", c_double)]


class clamor_part_info(Structure):
    _fields_ = [("bytes", c_uint32), ("triangles", c_uint32), ("level", c_uint64),
                ("pose", clamor_pose), ("is_disabled", c_uint32), ("name", c_char_p)]


class clamor_part_options(Structure):
    _fields_ = [("bytes", c_uint32), ("is_disabled", c_uint32), ("level", c_uint64),
                ("pose", clamor_pose), ("half_extents_m", c_double * 3),
                ("vertices_m", c_void_p), ("indices", c_void_p), ("vertices", c_uint32),
                ("triangles", c_uint32), ("transmission", c_double * 8),
                ("absorption", c_double * 8), ("scattering", c_double * 8)]


class clamor_voice(Structure):
    _fields_ = [("slot", c_uint32), ("starts", c_uint32), ("sound", c_uint64),
                ("level_sound", c_uint32), ("direction", c_float * 3), ("delay_s", c_double),
                ("band_gains", c_float * 8)]


class clamor_voices(Structure):
    _fields_ = [("bytes", c_uint32), ("capacity", c_uint32), ("voices", POINTER(clamor_voice)),
                ("count", c_uint32), ("time_s", c_double)]


_context, _handle = c_void_p, c_uint64
_error = POINTER(clamor_error)

SIGNATURES: Signatures = {
    "clamor_result_text": (c_char_p, [c_int32]),
    "clamor_version": (c_uint32, []),
    "clamor_abi_version": (c_uint32, []),
    "clamor_create": (c_int32, [POINTER(clamor_options), POINTER(c_void_p), _error]),
    "clamor_destroy": (None, [_context]),
    "clamor_update": (c_int32, [_context, c_double, POINTER(c_uint32)]),
    "clamor_open_level": (c_int32, [_context, c_char_p, POINTER(c_uint64), _error]),
    "clamor_open_level_with": (c_int32, [_context, POINTER(clamor_reader), POINTER(c_uint64),
                                         _error]),
    "clamor_close_level": (c_int32, [_context, _handle]),
    "clamor_get_level_info": (c_int32, [_context, _handle, POINTER(clamor_level_info)]),
    "clamor_get_emitter_info": (c_int32, [_context, _handle, c_uint32,
                                          POINTER(clamor_emitter_info)]),
    "clamor_find_emitter": (c_int32, [_context, _handle, c_char_p, POINTER(c_uint32)]),
    "clamor_get_portal_info": (c_int32, [_context, _handle, c_uint32,
                                         POINTER(clamor_portal_info)]),
    "clamor_find_portal": (c_int32, [_context, _handle, c_char_p, POINTER(c_uint32)]),
    "clamor_create_listener": (c_int32, [_context, _handle, POINTER(clamor_listener_options),
                                         POINTER(c_uint64), _error]),
    "clamor_destroy_listener": (c_int32, [_context, _handle]),
    "clamor_enter_level": (c_int32, [_context, _handle, _handle, _error]),
    "clamor_move_listener": (c_int32, [_context, _handle, POINTER(clamor_pose)]),
    "clamor_next_keyframe": (c_int32, [_context, _handle, POINTER(c_uint32), POINTER(c_double)]),
    "clamor_get_channels": (c_int32, [_context, _handle, POINTER(c_uint32)]),
    "clamor_get_listener_statistics": (c_int32, [_context, _handle,
                                                 POINTER(clamor_listener_statistics)]),
    "clamor_add_sound": (c_int32, [_context, c_void_p, c_uint64, POINTER(clamor_sound_options),
                                   POINTER(c_uint64), _error]),
    "clamor_read_sound": (c_int32, [_context, c_char_p, POINTER(clamor_sound_options),
                                    POINTER(c_uint64), _error]),
    "clamor_read_level_sound": (c_int32, [_context, _handle, c_uint32, POINTER(c_uint64), _error]),
    "clamor_add_stream": (c_int32, [_context, POINTER(clamor_stream), POINTER(c_uint64), _error]),
    "clamor_write_stream": (c_int32, [_context, _handle, c_void_p, c_uint32, POINTER(c_uint32)]),
    "clamor_remove_sound": (c_int32, [_context, _handle]),
    "clamor_add_group": (c_int32, [_context, POINTER(clamor_group_options), POINTER(c_uint64)]),
    "clamor_change_group": (c_int32, [_context, _handle, POINTER(clamor_group_options)]),
    "clamor_remove_group": (c_int32, [_context, _handle]),
    "clamor_add_source": (c_int32, [_context, POINTER(clamor_source_options), POINTER(c_uint64)]),
    "clamor_change_source": (c_int32, [_context, _handle, POINTER(clamor_source_options)]),
    "clamor_move_source": (c_int32, [_context, _handle, POINTER(clamor_motion)]),
    "clamor_remove_source": (c_int32, [_context, _handle]),
    "clamor_change_emitter": (c_int32, [_context, _handle, c_uint32,
                                        POINTER(clamor_emitter_options)]),
    "clamor_get_level_part": (c_int32, [_context, _handle, c_uint32, POINTER(c_uint64)]),
    "clamor_find_part": (c_int32, [_context, _handle, c_char_p, POINTER(c_uint64)]),
    "clamor_get_part_info": (c_int32, [_context, _handle, POINTER(clamor_part_info)]),
    "clamor_add_part": (c_int32, [_context, POINTER(clamor_part_options), POINTER(c_uint64),
                                  _error]),
    "clamor_move_part": (c_int32, [_context, _handle, POINTER(clamor_pose)]),
    "clamor_enable_part": (c_int32, [_context, _handle, c_uint32]),
    "clamor_remove_part": (c_int32, [_context, _handle]),
    "clamor_set_portal": (c_int32, [_context, _handle, c_uint32, c_double]),
    "clamor_commit": (c_int32, [_context, c_double]),
    "clamor_measure_responses": (c_int32, [_context, _handle, c_uint32, c_void_p, c_uint32,
                                           c_void_p, c_uint64, POINTER(c_uint64), _error]),
    "clamor_get_voices": (c_int32, [_context, _handle, POINTER(clamor_voices)]),
    "clamor_render": (c_int32, [_context, _handle, c_void_p, c_uint32]),
    "clamor_render_planar": (c_int32, [_context, _handle, c_void_p, c_uint32]),
}


@functools.lru_cache(maxsize=None)
def library() -> ctypes.CDLL:
    """libclamor, loaded at the first call."""
    return load("CLAMOR_LIBRARY", ("libclamor.so", "libclamor.so.0"),
                ("clamor_abi_version", CLAMOR_ABI_VERSION), SIGNATURES)


check = checker(lambda: library().clamor_result_text)
