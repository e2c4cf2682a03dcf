"""Clamor: baked room acoustics of glTF levels and triangle meshes.

    level = clamor.open("room.clamor")
    sound = clamor.render_walk(level, [0, 1.7, 3], seconds=5)      # (240000, 2), float32

Positions are metres in the frame of glTF: +X right, +Y up; listeners look along -Z at first.
Samples are amplitudes, 1 at full scale. Functions raise ClamorError, whose text says what is wrong
and what to do, and ValueError or TypeError for arguments of a wrong value, shape or type.
"""
from ._library import ClamorError, ClamorWarning
from .baking import BakeLevel, BakeProgress, BakeReport, bake, presets
from .impulse import impulse_responses, spatial_impulse_responses
from .information import EmitterInfo, LevelInfo, PartInfo, PortalInfo, Statistics
from .offline import open, render_walk
from .parts import Part
from .sound_file import write_wav
from .sources import Group, Sound, Source, Stream
from .walk import Pose, Walk, orientation
from .world import Context, Level, LevelPart, Listener

__all__ = ["BakeLevel", "BakeProgress", "BakeReport", "ClamorError", "ClamorWarning",
           "Context", "EmitterInfo",
           "Group", "Level", "LevelInfo", "LevelPart", "Listener", "Part", "PartInfo", "PortalInfo",
           "Pose", "Sound", "Source", "Statistics", "Stream", "Walk", "bake", "impulse_responses",
           "open", "orientation", "presets", "render_walk", "spatial_impulse_responses",
           "write_wav"]
__version__ = "0.1.0"
