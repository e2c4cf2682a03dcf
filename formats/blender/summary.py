"""Summary of a bake file for the panel. This module knows nothing of Blender."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Summary:
    """The figures that the panel shows."""

    facts: tuple[tuple[str, str], ...]
    bands_hz: tuple[int, ...]
    t30_s: tuple[float | None, ...]  # decay times per band
    warnings: tuple[str, ...]


def band_name(hz: int) -> str:
    return f"{hz} Hz" if hz < 1000 else f"{hz // 1000} kHz"


def _size(count: int) -> str:
    for unit, size in (("GB", 1e9), ("MB", 1e6), ("kB", 1e3)):
        if count >= size:
            return f"{count / size:.2f} {unit}"
    return f"{count} bytes"


def summary_of(bake: dict) -> Summary:
    """Summarises the object that `clamor inspect --json` prints."""
    photons, power = bake["photons"], bake["power"]
    escaped = sum(power["escaped"]) / max(sum(power["emitted"]), 1e-30)
    facts = (
        ("Emitters", f"{bake['sources']['emitters']:,}"),
        ("Reflections", f"{bake['sources']['secondary']:,}"),
        ("Photons", f"{photons['traced']:,}"),
        ("Escaped", f"{100 * escaped:.1f} % of the power"),
        ("Mean free path", f"{photons['mean_free_path_m']:.2f} m"),
        ("File", _size(bake["bytes"]["file"])),
    )
    return Summary(
        facts,
        tuple(bake["bands_hz"]),
        tuple(bake["decay"]["t30_s"]),
        tuple(bake["warnings"]),
    )
