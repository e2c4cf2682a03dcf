"""Emitters and materials as the values of glTF extensions, without the exporter's classes."""

from typing import Any

EMITTER_EXTENSION = "KHR_audio_emitter"
MATERIAL_EXTENSION = "CLAMOR_materials_acoustic"
TIMING_EXTENSION = "CLAMOR_emitter"


def _decimal(value: float) -> float:
    # Blender stores single precision; 0.3 must not become 0.30000001192092896 in the file.
    return round(value, 6)


def positional_values(emitter: Any) -> dict[str, Any]:
    if emitter.kind != "CONE":
        return {"shapeType": "omnidirectional"}
    return {
        "shapeType": "cone",
        "coneInnerAngle": _decimal(emitter.cone_inner_angle),
        "coneOuterAngle": _decimal(max(emitter.cone_inner_angle, emitter.cone_outer_angle)),
        "coneOuterGain": _decimal(emitter.cone_outer_gain),
    }


def emitter_values(emitter: Any) -> dict[str, Any]:
    """An entry of `emitters`, without its sources."""
    values: dict[str, Any] = {
        "type": "global" if emitter.kind == "GLOBAL" else "positional",
        "gain": _decimal(10 ** (emitter.gain_db / 20)),
    }
    if emitter.kind != "GLOBAL":
        values["positional"] = positional_values(emitter)
    return values


def timing_values(emitter: Any) -> dict[str, float]:
    """Clamor's additions to an emitter, empty by default."""
    values = {
        "delay_s": _decimal(emitter.delay_s),
        "random_delay_s": _decimal(emitter.random_delay_s),
    }
    return {key: value for key, value in values.items() if value > 0}


def material_values(material: Any) -> dict[str, Any]:
    """CLAMOR_materials_acoustic of a material; eight values mean the octaves from 63 Hz to 8 kHz."""
    values: dict[str, Any] = {}
    if material.preset:
        values["preset"] = material.preset
    for quantity in ("absorption", "scattering", "transmission"):
        if getattr(material, "use_" + quantity):
            values[quantity] = [_decimal(value) for value in getattr(material, quantity)]
    return values
