"""Every public call of the Python package refuses wrong arguments with a TypeError or ValueError that
names the argument: python_arguments.py LEVEL, a level with a movable part and a portal."""
import inspect
import sys

import numpy as np

import clamor

NAN, INF = float("nan"), float("inf")

# Wrong values, by the name of the parameter.
COUNT = [-1, 1.5, "3", [1], True, 10**400]
RATE = [*COUNT, 0, 7]
SIZE = [-1, NAN, INF, "loud", [1, 2], True, 10**400]
FINITE = [NAN, INF, "loud", True, 10**400]
PLACE = [[NAN, 0, 0], [0, INF, 0], [1, 2], "here", 5, ["a", "b", "c"]]
FLAG = ["yes", 2, [True], 0.5]
TEXT = [5, ["a"], "a\0b"]
BANDS = [-1, NAN, "some", [0.5] * 7, [NAN] * 8]
FUNCTION = [5, "call"]
POSE = [*PLACE, clamor.Pose([0, 0, NAN]), clamor.Pose([0, 0, 0], (0, 0, 0, 0)),
        clamor.Pose([0, 0, 0], (0, 0, 1))]
PLACES = [[0, 0, 0], [[0, 0]], [[NAN, 0, 0]], "here", [["a", "b", "c"]], 5]
OUT = [[0.0], np.empty((1, 2)), "out"]
TIMES = [[NAN], "now", []]
ANGLES = [NAN, "left", [0, 1, 2]]
OBJECT = [5, "it"]

WRONG = {
    "absorption": BANDS, "acoustics": TEXT, "axis": [*PLACE, [0, 0, 0]], "band_gains": BANDS,
    "caller_updates": FLAG, "context": OBJECT, "delay_s": SIZE, "directivity": BANDS,
    "early_order": [*COUNT, 4], "emitter": [*COUNT, 9], "emitters": ["one", [5]],
    "ends_with_sound": FLAG, "facing": PLACE, "frames": COUNT, "gain": SIZE, "goal_error_db": SIZE,
    "goal_s": SIZE, "group": OBJECT, "half_extents_m": [*PLACE, [0, 1, 1]], "hidden_meshes": FLAG,
    "high_m": PLACE, "humidity_percent": FINITE, "instances": FLAG, "is_enabled": FLAG,
    "is_muted": FLAG, "is_paused": FLAG, "journal": TEXT, "late": [5, "wet", None],
    "layout": TEXT, "level": OBJECT,
    "limits": FLAG, "loading_s": SIZE, "log": FUNCTION, "longest_path_s": SIZE, "loop": FLAG,
    "loops": FLAG, "low_m": PLACE, "material": COUNT, "max_block_frames": COUNT,
    "max_sounds": [*COUNT, 5000], "max_sources": [*COUNT, 70_000], "max_voices": [*SIZE, 0, 2],
    "memory_bytes": COUNT, "mixing": [5, "both", None], "name": TEXT, "number": [*COUNT, 9],
    "offline": FLAG, "openness": [*SIZE, 2],
    "orientation": [], "out": OUT, "output": [5, "quadraphonic", None], "path": TEXT, "phong": BANDS,
    "photons": COUNT, "pitch_deg": ANGLES, "pitch_rad": FINITE, "places_m": PLACES,
    "played_s": [*SIZE, 1e7], "plays_once": FLAG, "pose": POSE, "poses": [*PLACE, [[0, 0, 0]]],
    "position_m": PLACE, "positions_m": PLACES, "preset": TEXT, "pressure_kpa": FINITE,
    "progress": FUNCTION, "pull": FUNCTION, "rate_hz": RATE, "reports_voices": FLAG,
    "reverberation": [*SIZE, 101], "roll_deg": ANGLES, "roll_rad": FINITE, "roulette_exponent": SIZE,
    "samples": ["la", [["a"]], np.zeros((2, 2, 2))], "scattering": BANDS, "seconds": [*SIZE, 1e6],
    "probe_spacing_m": ["1", -2, None], "seed": COUNT, "simplify_m": SIZE, "sofa": TEXT,
    "sound": [5, [[1.0]], None], "source": [5, None, [1]],
    "sources": COUNT, "strict": FLAG, "temperature_c": FINITE, "threads": [*COUNT, 5000], "time_s": FINITE,
    "times_s": TIMES, "transmission": BANDS, "triangles": ["all", [[0, 1]], [[0, 1, 9]], [[0.5, 1, 2]]],
    "update_period_s": [*SIZE, 1], "velocity_mps": [*PLACE, [1e6, 0, 0]],
    "vertices_m": ["corners", [[0, 0]], [[NAN, 0, 0]]], "voices": [*COUNT, 0], "yaw_deg": ANGLES,
    "yaw_rad": FINITE,
}
# Parameters that a call takes otherwise.
OTHERWISE = {
    ("BakeLevel", "material"): TEXT, ("BakeLevel.add_emitter", "sound"): COUNT,
    ("Source", "sound"): OBJECT, ("Source.change", "sound"): OBJECT, ("Walk.read", "path"): [5],
    ("write_wav", "path"): [], ("write_wav", "rate_hz"): COUNT, ("bake", "level"): [5],
    ("Walk", "times_s"): [*TIMES, [1, 0]], ("BakeLevel", "path"): [5, "a\0b"],
    ("Part", "level"): OBJECT, ("BakeLevel.add_sound", "sound"): [5, [[1.0]]],
}


def refuses(name, call, valid, signature):
    """Returns the number of wrong values that a call has refused."""
    tried = 0
    for parameter in inspect.signature(signature).parameters.values():
        if parameter.kind is parameter.VAR_KEYWORD or parameter.name == "self":
            continue
        for wrong in OTHERWISE.get((name, parameter.name), WRONG[parameter.name]):
            try:
                call(**{**valid, parameter.name: wrong})
            except (TypeError, ValueError) as error:
                words = {parameter.name, *({"path"} if (name, parameter.name) == ("bake", "level") else ())}
                assert any(word in str(error) for word in words), (name, parameter.name, wrong, str(error))
                assert "rgument" not in str(error), (name, parameter.name, wrong, str(error))
            else:
                raise AssertionError(f"{name}({parameter.name}={wrong!r}) did not raise")
            tried += 1
    return tried


def main(level_path):
    context = clamor.Context(caller_updates=True)
    level = context.open(level_path)
    at = [4, 1.6, 7]
    listener = context.listen(level, at, output="receivers")
    sound = clamor.Sound(context, np.ones(48, np.float32))
    source = clamor.Source(context, sound, at)
    room = clamor.BakeLevel(name="room")
    wall = room.add_material("plaster")
    noise = room.add_sound("noise")
    corners, triangle = [[0, 0, 0], [1, 0, 0], [0, 0, 1]], [[0, 1, 2]]
    with_emitter = clamor.BakeLevel(name="room")
    with_emitter.add_box([0, 0, 0], [3, 3, 3], with_emitter.add_material("plaster"))
    with_emitter.add_emitter(with_emitter.add_sound("impulse", plays_once=True), [1, 1, 1])
    baked, _ = with_emitter.bake(photons=10, sources=10)
    playing = clamor.open(baked)
    places = [[1, 1, 2]]
    named = {"context": context}
    material = dict(preset="plaster", name="wall", absorption=0.5)
    cheap = dict(output="receivers", voices=5)

    def baked_level(**options):
        return clamor.bake(**options)

    calls = [
        ("open", clamor.open, dict(source=level_path)),
        ("Context", clamor.Context, {}),
        ("Context.open", context.open, dict(source=level_path)),
        ("Context.listen", context.listen, dict(level=level, pose=at)),
        ("Context.commit", context.commit, {}),
        ("Context.update", context.update, {}),
        ("Level", clamor.Level, dict(context=context, source=level_path)),
        ("Level.find_emitter", level.find_emitter, {}),
        ("Level.portal", level.portal, {}),
        ("Level.find_portal", level.find_portal, {}),
        ("Level.set_portal", level.set_portal, dict(number=0, openness=1)),
        ("Level.part", level.part, {}),
        ("Level.find_part", level.find_part, {}),
        ("Level.emitter", level.emitter, {}),
        ("Level.change_emitter", playing.change_emitter, dict(number=0)),
        ("LevelPart.move", level.part(0).move, {}),
        ("LevelPart.enable", level.part(0).enable, {}),
        ("Listener", clamor.Listener, dict(context=context, level=level, output="receivers")),
        ("Listener.move", listener.move, {}),
        ("Listener.enter", listener.enter, {}),
        ("Listener.render", listener.render, dict(frames=1)),
        ("Listener.render_planar", listener.render_planar, dict(frames=1)),
        ("Sound", clamor.Sound, dict(context=context, sound=[0.5])),
        ("Stream", clamor.Stream, named),
        ("Stream.write", clamor.Stream(context).write, {}),
        ("Group", clamor.Group, named),
        ("Group.change", clamor.Group(context).change, {}),
        ("Source", clamor.Source, dict(context=context, sound=sound)),
        ("Source.change", source.change, dict(sound=sound, position_m=at)),
        ("Source.move", source.move, dict(position_m=at)),
        ("Part", lambda **o: clamor.Part(**{**({} if "vertices_m" in o or "triangles" in o else
                                               {"half_extents_m": [1, 1, 1]}),
                                            **({"vertices_m": corners} if "triangles" in o else {}),
                                            **o}), named, clamor.Part),
        ("BakeLevel", lambda **o: clamor.BakeLevel(**{**({} if "path" in o or "name" in o else
                                                         {"path": "level.glb"}), **o}), {},
         clamor.BakeLevel),
        ("BakeLevel.add_material", room.add_material, material),
        ("BakeLevel.add_triangles", room.add_triangles,
         dict(vertices_m=corners, triangles=triangle, material=wall)),
        ("BakeLevel.add_box", room.add_box, dict(low_m=[0, 0, 0], high_m=[1, 1, 1], material=wall)),
        ("BakeLevel.add_sound", room.add_sound, dict(sound=np.ones(8))),
        ("BakeLevel.add_emitter", room.add_emitter, dict(sound=noise, position_m=[0, 0, 0])),
        ("BakeLevel.set_air", room.set_air, {}),
        ("bake", baked_level, dict(level=with_emitter), clamor.bake),
        ("impulse_responses", clamor.impulse_responses,
         dict(level=playing, places_m=places, seconds=0.01)),
        ("spatial_impulse_responses", clamor.spatial_impulse_responses,
         dict(level=playing, places_m=places, seconds=0.01, **cheap)),
        ("render_walk", clamor.render_walk, dict(level=playing, poses=at, seconds=0.01, **cheap)),
        ("Walk", clamor.Walk, dict(times_s=[0], positions_m=[at])),
        ("Walk.read", clamor.Walk.read, {}),
        ("Walk.__call__", clamor.Walk([0], [at]).__call__, {}),
        ("orientation", clamor.orientation, dict(yaw_rad=0)),
        ("write_wav", clamor.write_wav, dict(path="/nowhere/a.wav", samples=np.ones(2))),
    ]
    tried = 0
    for name, call, valid, *signature in calls:
        tried += refuses(name, call, valid, signature[0] if signature else call)
    for name, call in (("Source", clamor.Source), ("Source.change", source.change)):  # its **options
        tried += refuses(name, lambda **o: call(**{**dict(context=context), **o} if name == "Source" else o),
                         dict(sound=sound, position_m=at), clamor.Source._options)

    # Nothing public is forgotten.
    public = set()
    for name in clamor.__all__:
        thing = getattr(clamor, name)
        if inspect.isclass(thing) and not issubclass(thing, (tuple, Exception)):
            public |= {name} | {f"{name}.{method}" for method, value in vars(thing).items()
                                if (not method.startswith("_") or method == "__call__")
                                and (inspect.isfunction(value) or isinstance(value, classmethod))}
        elif inspect.isfunction(thing):
            public.add(name)
    without_arguments = {"presets", "Listener.voices", "Listener.next_keyframe_s", "LevelPart",
                         "BakeLevel.bake"}
    missing = public - {name for name, *_ in calls} - without_arguments
    assert not missing, missing
    assert tried > 500, tried


if __name__ == "__main__":
    main(sys.argv[1])
