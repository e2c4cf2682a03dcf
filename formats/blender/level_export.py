"""Exports a scene as a level that `clamor bake` reads, and checks it first."""

from pathlib import Path

import bpy

from . import sounds
from .bake_process import ClamorError


def output_path(scene: bpy.types.Scene) -> Path:
    """The bake file of a scene."""
    written = scene.clamor_bake.output
    if not written:
        raise ClamorError("Choose an output file in Scene > Clamor, as in //hall.clamor.")
    if written.startswith("//") and not bpy.data.filepath:
        raise ClamorError("Save the .blend file first: the output lies beside it.")
    path = Path(bpy.path.abspath(written))
    return path if path.suffix == ".clamor" else path.with_name(path.name + ".clamor")


def level_path(bake: Path) -> Path:
    """The level of a bake file, which is not the name of the user's own export."""
    return bake.with_name(bake.stem + "_level.glb")


def _emitters(scene: bpy.types.Scene) -> list[bpy.types.Object]:
    return [o for o in scene.objects if o.clamor_emitter.enabled and not o.hide_render]


def check(scene: bpy.types.Scene) -> None:
    """Raises ClamorError for what an export would otherwise leave out silently."""
    for emitter in _emitters(scene):
        sound = emitter.clamor_emitter.sound
        if sound is None:
            raise ClamorError(f"'{emitter.name}' is a sound emitter without a sound. Open one.")
        if not sounds.is_readable(sound):
            raise ClamorError(
                f"'{emitter.name}': the sound file {sounds.path_of(sound)} is missing. "
                "Open it again, or use File > External Data > Find Missing Files."
            )


def unit_warning(scene: bpy.types.Scene) -> str:
    """glTF export ignores the unit scale, so acoustics would be wrong in size."""
    scale = scene.unit_settings.scale_length
    if abs(scale - 1) < 1e-6:
        return ""
    return f"The unit scale is {scale:g}, but glTF takes one Blender unit as one metre. Set it to 1."


def export_level(scene: bpy.types.Scene, path: Path) -> None:
    """Writes what acoustics need: everything that is rendered, with modifiers, without images."""
    path.parent.mkdir(parents=True, exist_ok=True)
    # The exporter leaves out cameras and lights unless asked, with the emitters on them.
    kinds = {o.type for o in _emitters(scene)}
    options = {
        "filepath": str(path),
        "check_existing": False,
        "export_format": "GLB",
        "export_yup": True,
        "export_apply": True,
        "export_materials": "EXPORT",
        "export_image_format": "NONE",
        "export_texcoords": False,
        "export_animations": False,
        "export_skins": False,
        "export_morph": False,
        "export_cameras": "CAMERA" in kinds,
        "export_lights": "LIGHT" in kinds,
        "use_renderable": True,
        "use_active_scene": True,
        "use_visible": False,
        "use_selection": False,
    }
    if not hasattr(bpy.types, "EXPORT_SCENE_OT_gltf"):
        raise ClamorError("Enable the add-on 'glTF 2.0 format' in the preferences; it exports.")
    known = bpy.ops.export_scene.gltf.get_rna_type().properties.keys()
    try:
        bpy.ops.export_scene.gltf(**{k: v for k, v in options.items() if k in known})
    except (RuntimeError, OSError) as error:
        raise ClamorError(f"The glTF export failed: {error}") from error


def bake_command(program: str, scene: bpy.types.Scene, level: Path, output: Path) -> list[str]:
    settings = scene.clamor_bake
    command = [program, "bake", str(level), "-o", str(output), "--seed", str(settings.seed)]
    if settings.until:
        command += ["--until", settings.until]
    else:
        if settings.photons > 0:
            command += ["--photons", str(settings.photons)]
        if settings.sources > 0:
            command += ["--sources", str(settings.sources)]
    if settings.material:
        command += ["--material", settings.material]
    return command
