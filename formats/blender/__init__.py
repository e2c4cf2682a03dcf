"""Clamor's Blender add-on: sound emitters, acoustic materials, and baking from Blender."""

import bpy

from . import operators, panels, preferences, properties, session
from .export_hooks import glTF2ExportUserExtension  # io_scene_gltf2 looks for this name here

bl_info = {
    "name": "Clamor: baked acoustics",
    "description": "Sound emitters (KHR_audio_emitter) and acoustic materials in every glTF export, "
    "and a button that bakes the acoustics of the scene",
    "author": "The authors of Clamor",
    "version": (0, 1, 0),
    "blender": (3, 4, 0),
    "location": "Properties > Object, Material and Scene; Add > Sound Emitter",
    "category": "Import-Export",
}

__all__ = ["bl_info", "glTF2ExportUserExtension", "register", "unregister"]

_CLASSES = (*properties.CLASSES, *preferences.CLASSES, *operators.CLASSES, *panels.CLASSES)


def register() -> None:
    for cls in _CLASSES:
        bpy.utils.register_class(cls)
    properties.attach()
    bpy.types.VIEW3D_MT_add.append(panels.draw_add_menu)


def unregister() -> None:
    session.current.stop()
    bpy.types.VIEW3D_MT_add.remove(panels.draw_add_menu)
    properties.detach()
    for cls in reversed(_CLASSES):
        bpy.utils.unregister_class(cls)
