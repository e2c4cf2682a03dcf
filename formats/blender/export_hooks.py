"""Adds emitters and acoustic materials to every glTF that Blender exports.

Blender's exporter (io_scene_gltf2) finds the class below and its methods by their names. The exporter
hides exceptions of the methods, so a sound that cannot be read is reported on the console, and its
emitter is exported without source.
"""

from typing import Any

import bpy

from . import gltf_values, sounds


def _extension_classes() -> tuple[type, type, type]:
    """Extension, ChildOfRootExtension and BinaryData, which move between versions of Blender.

    They are imported for each export, because Blender may have reloaded the exporter, which
    compares classes.
    """
    from io_scene_gltf2.io.com.gltf2_io_extensions import ChildOfRootExtension, Extension

    try:
        from io_scene_gltf2.io.exp.binary_data import BinaryData  # its new name
    except ImportError:
        from io_scene_gltf2.io.exp.gltf2_io_binary_data import BinaryData
    return Extension, ChildOfRootExtension, BinaryData


class glTF2ExportUserExtension:
    """One export. Newer exporters may pass more arguments to a hook, which are ignored."""

    def __init__(self) -> None:
        self._extension, self._child_of_root, self._binary_data = _extension_classes()
        self._audio: dict[str, Any] = {}  # by the sound's name: each sound is stored once

    def gather_node_hook(self, node: Any, blender_object: Any, *_others: Any) -> None:
        emitter = getattr(blender_object, "clamor_emitter", None)
        if emitter is None or not emitter.enabled:
            return
        name = gltf_values.EMITTER_EXTENSION
        self._add(node, name, {"emitters": [self._emitter(emitter, blender_object.name)]})

    def gather_material_hook(self, material: Any, blender_material: Any, *_others: Any) -> None:
        acoustics = getattr(blender_material, "clamor_acoustics", None)
        if acoustics is not None and acoustics.enabled:
            values = gltf_values.material_values(acoustics)
            self._add(material, gltf_values.MATERIAL_EXTENSION, values)

    def gather_material_unlit_hook(self, material: Any, blender_material: Any, *_: Any) -> None:
        self.gather_material_hook(material, blender_material)

    def _add(self, owner: Any, name: str, values: dict[str, Any]) -> None:
        if owner.extensions is None:
            owner.extensions = {}
        owner.extensions[name] = self._extension(name=name, extension=values, required=False)

    def _entry(self, list_name: str, values: dict[str, Any]) -> Any:
        """An entry of a list at the document's root. The exporter merges equal entries."""
        return self._child_of_root(
            path=[list_name],
            name=gltf_values.EMITTER_EXTENSION,
            extension=values,
            required=False,
        )

    def _emitter(self, emitter: Any, object_name: str) -> Any:
        values = gltf_values.emitter_values(emitter)
        source = self._source(emitter, object_name)
        values["sources"] = [] if source is None else [source]
        if emitter.sound is not None:  # the object's name would keep equal emitters apart
            values["name"] = emitter.sound.name
        timing = gltf_values.timing_values(emitter)
        if timing:
            name = gltf_values.TIMING_EXTENSION
            values["extensions"] = {name: self._extension(name, timing, False)}
        return self._entry("emitters", values)

    def _source(self, emitter: Any, object_name: str) -> Any:
        if emitter.sound is None:
            print(f"Clamor: emitter '{object_name}' has no sound; it is exported silent.")
            return None
        try:
            audio = self._audio_of(emitter.sound)
        except OSError as error:
            print(f"Clamor: emitter '{object_name}' is exported silent: {error}")
            return None
        return self._entry("sources", {"audio": audio, "loop": emitter.loop, "autoplay": True})

    def _audio_of(self, sound: bpy.types.Sound) -> Any:
        known = self._audio.get(sound.name_full)
        if known is None:
            data = sounds.bytes_of(sound)
            values = {
                "name": sound.name,
                "mimeType": sounds.mime_type_of(data),
                "bufferView": self._binary_data(data),
            }
            known = self._audio[sound.name_full] = self._entry("audio", values)
        return known
