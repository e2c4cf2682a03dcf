"""demo.py SHIPPED BAKED: fails if what the Bake button makes of the demo has another sound, emitter or material than the
bake that the demo comes with, as `clamor inspect --json` tells of both."""
import json
import sys

shipped, baked = (json.load(open(path, encoding="utf-8")) for path in sys.argv[1:])


def rounded(values):
    return tuple(round(value, 4) for value in values)


def emitters(bake):
    return [(e["name"], rounded(e["position_m"]), rounded(e["axis"]), e["gain"]) for e in bake["emitters"]]


def materials(bake):
    return {(rounded(m["absorption"]), rounded(m["scattering"]), rounded(m["transmission"])) for m in bake["materials"]}


wrong = [what for what, is_right in {
    "emitters": emitters(baked) == emitters(shipped),
    "materials": materials(baked) == materials(shipped),
    "sound": baked["bytes"]["signals"] == shipped["bytes"]["signals"],
    "screen": [part["name"] for part in baked["movable_parts"]] == ["Screen"],
}.items() if not is_right]
print(f"the demo's bake: {len(materials(baked))} materials, {len(emitters(baked))} emitter;", *(wrong or ["all"]), "wrong" if wrong else "right")
sys.exit(bool(wrong))
