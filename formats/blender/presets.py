"""The material presets of Clamor, from the copy of assets/materials.json in the add-on's zip file."""

import json
import math
from dataclasses import dataclass
from functools import cache
from pathlib import Path

BANDS_HZ = (63, 125, 250, 500, 1000, 2000, 4000, 8000)


@dataclass(frozen=True)
class Preset:
    """Values per octave band; a material without transmission lets no sound through."""

    absorption: tuple[float, ...]
    scattering: tuple[float, ...]
    transmission: tuple[float, ...]
    source: str


def transmitted(reduction_db: float, absorption: float) -> float:
    """Share of the power that passes, at most the absorption."""
    return min(10 ** (-reduction_db / 10), absorption)


@cache
def presets() -> dict[str, Preset]:
    """All presets by name."""
    path = Path(__file__).with_name("materials.json")
    document = json.loads(path.read_text(encoding="utf-8"))
    infinite = (math.inf,) * len(BANDS_HZ)
    return {
        name: Preset(
            tuple(values["absorption"]),
            tuple(values["scattering"]),
            tuple(
                map(transmitted, values.get("sound_reduction_db", infinite), values["absorption"])
            ),
            values.get("source", ""),
        )
        for name, values in document["materials"].items()
    }


def names_like(text: str) -> list[str]:
    """Names of presets that contain `text`, for search fields."""
    return [name for name in sorted(presets()) if text.lower() in name]
