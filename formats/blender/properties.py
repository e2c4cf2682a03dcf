"""Properties of objects, materials and scenes, which .blend files store."""

import math

import bpy
from bpy.props import (
    BoolProperty,
    EnumProperty,
    FloatProperty,
    FloatVectorProperty,
    IntProperty,
    PointerProperty,
    StringProperty,
)

from .presets import BANDS_HZ, names_like

_GREATEST_GAIN_DB = 80.0  # Clamor's limit
_GREATEST_DELAY_S = 3600.0
# Blender 4.5 and later warn of a path that begins with // unless the property declares it.
_RELATIVE_PATH = {"PATH_SUPPORTS_BLEND_RELATIVE"} if bpy.app.version >= (4, 5, 0) else set()


def _preset_names(_self: object, _context: object, text: str) -> list[str]:
    return names_like(text)


def _preset(description: str) -> object:
    # This is no enumeration, because Blender stores those as numbers, which would change their
    # meaning when a preset is added.
    return StringProperty(
        name="Preset", description=description, search=_preset_names, search_options={"SORT"}
    )


def _override(quantity: str) -> object:
    return BoolProperty(name=quantity, description=f"Set the {quantity.lower()} of each octave band")


def _bands(name: str, description: str, default: float) -> object:
    return FloatVectorProperty(
        name=name,
        description=description,
        size=len(BANDS_HZ),
        min=0.0,
        max=1.0,
        default=[default] * len(BANDS_HZ),
        precision=2,
    )


class ClamorEmitter(bpy.types.PropertyGroup):
    """A sound that an object emits."""

    enabled: BoolProperty(name="Sound Emitter", description="This object emits a sound")
    kind: EnumProperty(
        name="Kind",
        items=(
            ("OMNIDIRECTIONAL", "Omnidirectional", "Emits equally in all directions"),
            ("CONE", "Cone", "Emits along the object's local +Y axis (cameras and lights: -Z)"),
            ("GLOBAL", "Global", "Has no position, like music; Clamor's bake leaves it out"),
        ),
    )
    sound: PointerProperty(name="Sound", type=bpy.types.Sound, description="The sound it emits")
    gain_db: FloatProperty(
        name="Gain (dB)",
        description="Gain at 1 m on the axis; 0 dB plays the sound file as it is",
        min=-120.0,
        max=_GREATEST_GAIN_DB,
        soft_min=-60.0,
        soft_max=20.0,
        precision=1,
        step=50,
    )
    loop: BoolProperty(name="Loop", description="Repeat the sound for ever", default=True)
    cone_inner_angle: FloatProperty(
        name="Inner Angle",
        description="Full angle of the cone in which the gain is not reduced",
        subtype="ANGLE",
        min=0.0,
        max=2 * math.pi,
        default=math.radians(60),
    )
    cone_outer_angle: FloatProperty(
        name="Outer Angle",
        description="Full angle of the cone outside of which the outer gain holds",
        subtype="ANGLE",
        min=0.0,
        max=2 * math.pi,
        default=math.radians(180),
    )
    cone_outer_gain: FloatProperty(
        name="Outer Gain",
        description="Factor of the amplitude outside the outer angle",
        subtype="FACTOR",
        min=0.0,
        max=1.0,
    )
    delay_s: FloatProperty(
        name="Delay (s)",
        description="When the sound starts; where a loop starts within its period",
        min=0.0,
        max=_GREATEST_DELAY_S,
        precision=2,
    )
    random_delay_s: FloatProperty(
        name="Random (s)",
        description="Greatest random delay that is added, different for each instance of the object",
        min=0.0,
        max=_GREATEST_DELAY_S,
        precision=2,
    )


class ClamorMaterial(bpy.types.PropertyGroup):
    """Acoustics of a material. Values that are set override those of the preset."""

    enabled: BoolProperty(
        name="Acoustics",
        description="Export the acoustics below; otherwise Clamor takes a preset whose aliases match "
        "the material's name",
    )
    preset: _preset("Clamor's preset for the material, as in brick")
    use_absorption: _override("Absorption")
    use_scattering: _override("Scattering")
    use_transmission: _override("Transmission")
    absorption: _bands("Absorption", "Share of the energy that is not reflected", 0.1)
    scattering: _bands("Scattering", "Share of the reflected energy that is diffuse", 0.1)
    transmission: _bands(
        "Transmission", "Share of the energy that passes through, at most the absorption", 0.0
    )


class ClamorBake(bpy.types.PropertyGroup):
    """How a scene is baked."""

    output: StringProperty(
        name="Output",
        description="The bake file. The exported level is written beside it, as NAME_level.glb",
        subtype="FILE_PATH",
        options=_RELATIVE_PATH,
        default="//level.clamor",
    )
    until: StringProperty(
        name="Bake Until",
        description="An error as in 0.5dB, or a duration as in 15min; empty: as many photons as below",
    )
    photons: IntProperty(
        name="Photons", description="Photons to trace; 0: enough for the sources", min=0
    )
    sources: IntProperty(
        name="Sources",
        description="Greatest number of secondary sources; 0: 200 000 per room with emitters",
        min=0,
    )
    seed: IntProperty(
        name="Seed", description="The same seed gives the same bytes", min=0, default=1
    )
    material: _preset("For materials without acoustics whose names match no preset; empty: plaster")


CLASSES = (ClamorEmitter, ClamorMaterial, ClamorBake)


def attach() -> None:
    bpy.types.Object.clamor_emitter = PointerProperty(type=ClamorEmitter)
    bpy.types.Material.clamor_acoustics = PointerProperty(type=ClamorMaterial)
    bpy.types.Scene.clamor_bake = PointerProperty(type=ClamorBake)


def detach() -> None:
    del bpy.types.Object.clamor_emitter
    del bpy.types.Material.clamor_acoustics
    del bpy.types.Scene.clamor_bake
