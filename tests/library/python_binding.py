"""Checks of the Python package that python_binding_test.cpp runs: python_binding.py CHECK ARGUMENT..."""
import ctypes
import gc
import json
import subprocess
import sys
import threading
import tracemalloc
import warnings

import numpy as np

import clamor


def kind(type_):
    """The word of header_table.h for a ctypes type."""
    if type_ is None:
        return "v"
    letter = getattr(type_, "_type_", "P")
    if not isinstance(letter, str) or letter in "PzZO":
        return "p"
    return ("f" if letter in "fd" else "i" if letter.islower() else "u") + str(ctypes.sizeof(type_))


def declared_table(declared):
    """The lines of header_table.h for what the package declares of a header."""
    lines = set()
    for name, value in declared._declared.items():
        if isinstance(value, int):
            lines.add(f"constant {name} {value}")
        elif isinstance(value, type) and issubclass(value, ctypes.Structure):
            lines.add(f"struct {name} {ctypes.sizeof(value)}")
            for member, _ in value._fields_:
                place = getattr(value, member)
                lines.add(f"member {name} {member} {place.offset} {place.size}")
    for name, (result, arguments) in declared.signatures.items():
        lines.add(" ".join(["function", name, *map(kind, [result, *arguments])]))
    return lines


def interface(name, table):
    """The package declares all of a header, with its values, sizes, offsets and types."""
    declared = declared_table(getattr(sys.modules["clamor._library"], name))
    with open(table, encoding="ascii") as file:
        header = {line.strip() for line in file}
    for line in sorted(header - declared):
        print("the header has, and the package has not:", line)
    for line in sorted(declared - header):
        print("the package has, and the header has not:", line)
    assert len(header) > 50 and header == declared


def render(level_path, walk_path, wav_path, options):
    """render_walk() gives the samples that `clamor render` wrote."""
    with clamor.open(level_path) as level:
        samples = clamor.render_walk(level, clamor.Walk.read(walk_path), **json.loads(options))
    with open(wav_path, "rb") as file:
        written = np.frombuffer(file.read()[-samples.nbytes:], "<f4").reshape(samples.shape)
    assert np.abs(samples).max() > 0.001
    assert np.array_equal(samples, written), np.abs(samples - written).max()


def failure(call, *arguments, kind=clamor.ClamorError, **options):
    try:
        call(*arguments, **options)
    except kind as error:
        return error
    raise AssertionError(f"{call} did not raise")


def use(level_path):
    """Levels from bytes, listeners in real time, errors, and what is left when all is closed."""
    with open(level_path, "rb") as file:
        data = file.read()
    cheap = {"output": "receivers", "voices": 50}
    at = [0, 1.7, 3]
    with clamor.open(level_path) as level, clamor.open(data) as same:
        assert level.info == same.info and level.info.emitters == 1
        expected = clamor.render_walk(level, at, seconds=0.1, **cheap)
        assert expected.shape == (4800, 2) and expected.dtype == np.float32
        still = [at + [0, 0, 0, 1]] * 2
        for walk in ({"poses": clamor.Pose(at)}, {"poses": lambda time_s: clamor.Pose(at)},
                     {"poses": still, "times_s": [0, 1]}, {"poses": still[0]}):
            assert np.array_equal(clamor.render_walk(same, seconds=0.1, **walk, **cheap), expected)
        threads = [threading.Thread(target=clamor.render_walk, args=(level, at, 0.1), kwargs=cheap)
                   for _ in range(2)]
        [thread.start() for thread in threads], [thread.join() for thread in threads]
        assert failure(clamor.render_walk, level, [1, 2], kind=ValueError)
        for seconds, kind in ((-1, ValueError), (float("nan"), ValueError), ("1", TypeError)):
            assert "seconds" in str(failure(clamor.render_walk, level, at, seconds, kind=kind))
            assert "seconds" in str(failure(clamor.impulse_responses, level, [at], seconds, kind=kind))
        assert "emitter" in str(failure(clamor.impulse_responses, level, [at], emitter="violin", kind=TypeError))
        assert failure(clamor.render_walk, level, at, output="quadraphonic", kind=ValueError)
        assert failure(clamor.render_walk, level, at, rate_hz=7, kind=ValueError)

    assert failure(clamor.open, "no such file").code == -3
    assert "the level: " in str(failure(clamor.open, data[:1000]))
    with clamor.Context() as context, context.open(level_path) as level:
        listener = context.listen(level, at, rate_hz=44100, **cheap)
        block = np.zeros((441, 2), np.float32)
        for _ in range(50):
            listener.move(clamor.Pose(at, clamor.orientation(0.5)))
            assert listener.render(out=block) is block
        assert np.abs(block).max() > 0 and listener.statistics.keyframes > 0
        assert failure(listener.render, out=block.astype(float), kind=ValueError)
        assert failure(listener.move, [float("nan"), 0, 0], kind=ValueError)
        listener.close()
        listener.close()
        assert failure(listener.render, 16).code == -2
    assert failure(listener.render, 16, kind=ValueError)
    gc.collect()
    assert not sys.modules["clamor.world"]._used_by_library, "bytes are kept that nothing reads"


def sources(level_path):
    """The application's own sounds, streams, groups and sources, and voices for other mixers."""
    tone = np.sin(np.arange(48000) * 0.1).astype(np.float32)

    def peak(prepare, blocks=25):
        with clamor.Context(caller_updates=True) as context, context.open(level_path) as level:
            group = clamor.Group(context)
            kept = prepare(context, level, group)
            listener = context.listen(level, [0, 1.7, 3], output="receivers", voices=50, gain=1,
                                      reports_voices=True)
            context.commit()
            highest = 0.0
            for _ in range(blocks):
                context.update(0.1)
                highest = max(highest, np.abs(listener.render(480)).max())
            voices, _ = listener.voices()
            return highest, [voice for voice in voices if voice["sound"] != 0], kept

    def silent(context, level, group):
        return None

    def loud(context, level, group, gain=1000.0):
        sound = clamor.Sound(context, tone, loops=True)
        source = clamor.Source(context, sound, [0, 1.7, 1], group=group, gain=gain, level=level)
        source.move([0, 1.7, 1.5])
        return source

    def muted(context, level, group):
        group.change(is_muted=True)
        return loud(context, level, group)

    def pulled(context, level, group):
        def pull(samples):
            samples[:] = 0.5
            return len(samples)

        return clamor.Source(context, clamor.Stream(context, pull=pull), [0, 1.7, 1], gain=1000)

    def of_level(context, level, group):
        return clamor.Source(context, clamor.Sound(context, (level, 0)), [0, 1.7, 1], gain=1000)

    alone, of_application, _ = peak(silent)
    assert not of_application
    highest, of_application, source = peak(loud)
    assert highest > 100 > alone and len(of_application) == 1
    direction = of_application[0]["direction"]
    assert np.abs(direction - [0, 0, -1]).max() < 1e-3 and of_application[0]["band_gains"].max() > 100
    assert failure(source.move, [0, 0], kind=ValueError)
    assert peak(muted)[0] < 2 * alone and peak(pulled)[0] > 100 and peak(of_level)[0] > 10 * alone
    told = []
    with clamor.Context(caller_updates=True, log=told.append) as context:
        level = context.open(level_path)
        assert level.find_emitter(level.emitter(0).name) == 0 and level.emitter(0).gain > 0
        assert failure(level.find_emitter, "nobody").code == -12
        for portal in range(level.info.portals):
            assert level.find_portal(level.portal(portal).name) == portal
            level.set_portal(portal, 0.5)
            level.set_portal(portal, 1)
        assert failure(level.find_portal, "nowhere").code == -12
        listener = context.listen(level, [0, 1.7, 3], output="receivers", voices=50)

        # In real time it depends on the machine when a change is heard.
        def becomes(is_reached, blocks=2000):
            context.commit()
            for _ in range(blocks):
                context.update(0.1)
                if is_reached(np.abs(listener.render(480)).max()):
                    return True
            return False

        assert becomes(lambda peak: peak > 1e-6)
        for silence in {"is_muted": True}, {"gain": 0}:
            level.change_emitter(0, **silence)
            assert becomes(lambda peak: peak < 1e-9) and not told
            level.change_emitter(0)
            assert becomes(lambda peak: peak > 1e-6)
    gc.collect()
    assert not sys.modules["clamor.world"]._used_by_library, "callbacks are kept that nothing calls"
    with clamor.Context() as context:
        stream = clamor.Stream(context, 24000)
        assert stream.write(tone[:1000]) == 1000
        assert failure(clamor.Source, context, stream, gain=0, kind=ValueError)
        assert failure(clamor.Sound, context, "no such file").code == -3


def doors(level_path):
    """A source behind the door of a level: the door, its portal, boards, and reverberation."""
    tone = np.sin(np.arange(4800) * np.pi / 24).astype(np.float32)
    place = [4, 1.6, 3]
    with clamor.Context(caller_updates=True) as context, context.open(level_path) as level:
        listener = context.listen(level, [4, 1.6, 7], output="receivers", offline=True)
        sound = clamor.Sound(context, tone, loops=True)
        source = clamor.Source(context, sound, place)

        def power():
            """That of the last quarter of the next half second."""
            blocks = []
            for _ in range(50):
                while (time_s := listener.next_keyframe_s()) is not None:
                    context.commit(time_s)
                    context.update()
                blocks.append(listener.render(480).astype(float))
            return (np.concatenate(blocks[25:]) ** 2).sum()

        door, portal = level.find_part("Door"), level.find_portal("Door")
        assert level.info.parts == 1 and failure(level.find_part, "Gate").code == -12
        assert failure(level.part, 1, kind=ValueError)
        at_rest = clamor.Pose((3.4, 0, 4.5))
        assert level.part(0).info == clamor.PartInfo("Door", 12, at_rest, True)
        assert level.portal(portal) == ("Door", (4, 2, 4.5), (0.6, 0, 0), (0, 2, 0))
        level.set_portal(portal, 0)
        closed = power()
        door.move(clamor.Pose((3.4, 0, 4.5), clamor.orientation(np.pi / 2)))
        open_door = power()
        level.set_portal(portal, 1)
        assert open_door > 100 * closed and power() != open_door
        level.set_portal(portal, None)
        assert failure(level.set_portal, portal, 2, kind=ValueError)
        assert failure(door.move, [float("nan"), 0, 0], kind=ValueError)
        door.move(at_rest)
        door.enable(False)
        assert not door.info.is_enabled

        whole = power()
        source.change(sound, place, reverberation=0)
        direct = power()
        source.change(sound, place, reverberation=10)
        assert power() > 10 * whole and abs(whole - direct) > 0.05 * direct
        for hostile in -1, float("nan"), float("inf"), 1e7:
            assert failure(source.change, sound, place, reverberation=hostile, kind=ValueError)
        source.change(sound, place, reverberation=0)

        direct = power()
        corners = [[-20, -20, 0], [20, -20, 0], [20, 20, 0], [-20, 20, 0]]
        for shape in ({"half_extents_m": [20, 20, 0.02]},
                      {"vertices_m": corners, "triangles": [[0, 1, 2], [0, 2, 3]]},
                      {"vertices_m": np.array(corners)[[0, 1, 2, 0, 2, 3]]}):
            with clamor.Part(context, pose=at_rest, level=level, **shape) as board:
                assert board.info.name == "" and power() < 0.01 * direct
            assert abs(power() / direct - 1) < 0.01
            for wrong in "transmission", "absorption", "scattering":
                assert failure(clamor.Part, context, **{wrong: 2}, **shape, kind=ValueError)
        assert failure(clamor.Part, context, kind=ValueError)
        assert failure(clamor.Part, context, [1, 1], kind=ValueError)
        assert failure(clamor.Part, context, vertices_m=corners, kind=ValueError)
    assert failure(door.enable, True, kind=ValueError)


def bake(gltf_path, baked_path, folder):
    """Bakes have the bytes of `clamor bake`; numpy's triangles, cancelling and errors."""
    progress, path = [], folder + "/level.clamor"
    report = clamor.bake(gltf_path, path, photons=300, sources=1000, progress=progress.append)
    with open(path, "rb") as ours, open(baked_path, "rb") as theirs:
        data = ours.read()
        assert data == theirs.read()
    assert report.file_bytes == len(data) and report.photons == 300 and report.messages
    assert progress[-1].phase in ("tracing", "sorting", "writing") and progress[-1].photons_total == 300

    with clamor.BakeLevel(name="box") as room:
        wall = room.add_material(name="wall", absorption=0.3, scattering=[0.5] * 8)
        room.add_box([0, 0, 0], [6, 3, 8], wall)
        noise = np.random.default_rng(1).normal(0, 0.1, 44100)
        room.add_emitter(room.add_sound(noise, 44100, name="noise"), [2, 1.2, 3], directivity=1)
        assert failure(room.bake, photons=10**8, progress=lambda now: False).code == -10
        assert failure(room.bake, photons=10**8, progress=lambda now: 1 / 0, kind=ZeroDivisionError)
        assert failure(room.bake, early_order=4, kind=ValueError)
        assert failure(room.bake, early_order=-1, kind=ValueError)
        baked, report = room.bake(photons=1000, sources=1000)
        assert room.bake(photons=1000, sources=1000, early_order=0)[0] != baked
        assert "'plaster'" in str(failure(room.add_material, "plastr"))
        assert failure(room.add_triangles, np.zeros((3, 3)), [[0, 1, 3]], wall, kind=ValueError)
        assert failure(room.add_sound, folder + "/none.wav").code == -3
    assert failure(room.bake, kind=ValueError)
    with clamor.open(baked) as level:
        sound = clamor.render_walk(level, [4, 1.5, 6], seconds=0.2, output="receivers", voices=100)
        assert np.abs(sound).max() > 0.001 and level.info.emitters == 1


def respond(folder):
    """Impulse responses against the closed form of direct sound, and against `clamor impulse`."""
    emitter, places = np.array([2, 1.2, 3]), np.array([[4, 1.5, 6], [1, 1, 1], [5, 2, 7]])

    def box(absorption, **options):
        with clamor.BakeLevel(name="box") as room:
            wall = room.add_material(name="wall", absorption=absorption, scattering=0.5)
            room.add_box([0, 0, 0], [6, 3, 8], wall)
            room.add_emitter(room.add_sound("impulse", plays_once=True), emitter)
            return room.bake(**options)

    with clamor.open(box(1.0, photons=100)[0]) as level:
        distance_m = np.linalg.norm(places - emitter, axis=1)
        # The speed of sound is 343.2 m/s, and the impulse is a sinc of sum 1.
        spatial = clamor.spatial_impulse_responses(level, places, 0.05, "ambisonics")
        assert spatial.shape == (3, 16, 2400)
        for responses in (clamor.impulse_responses(level, places, seconds=0.05), spatial[:, 0]):
            assert responses.shape == (3, 2400) and responses.dtype == np.float32
            assert np.abs(np.abs(responses).argmax(1) - distance_m / 343.2 * 48000).max() < 1
            assert np.abs(responses.sum(1) * distance_m - 1).max() < 0.001
        assert failure(clamor.impulse_responses, level, places, emitter=1, kind=ValueError)
        assert failure(clamor.impulse_responses, level, places[0], kind=ValueError)

    path = folder + "/box.clamor"
    box(0.3, path=path, photons=3000, sources=1000)
    subprocess.run(["clamor", "impulse", path, "-o", folder + "/ir.wav", "--listener", "4,1.5,6",
                    "--strategy", "all"], check=True, capture_output=True)
    with open(folder + "/ir.wav", "rb") as file:
        data = file.read()
    expected = np.frombuffer(data[data.index(b"data") + 8:], "<f4").astype(float)
    with clamor.open(path) as level:
        measured = clamor.impulse_responses(level, places[:1], len(expected) / 48000)[0]
        spatial = clamor.spatial_impulse_responses(level, places[:1], 0.4, "receivers")[0, 0]
    assert np.abs(measured - expected).max() < 1e-6
    for begin in (0, 2400, 7200):  # the mixer gives arrivals other signs
        powers = [(response[begin:19200].astype(float) ** 2).sum() for response in (measured, spatial)]
        assert 0.63 < powers[0] / powers[1] < 1.6, (begin, powers)


def peak_bytes(call, *arguments, **options):
    """What Python and numpy allocate at most during a call."""
    tracemalloc.start()
    call(*arguments, **options)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    return peak


def arrays(folder):
    """The library reads places and writes samples in the caller's arrays, without copies."""
    with clamor.BakeLevel(name="box") as room:
        wall = room.add_material(name="wall", absorption=0.5, scattering=0.5)
        room.add_box([0, 0, 0], [6, 3, 8], wall)
        room.add_emitter(room.add_sound("impulse", plays_once=True), [2, 1.2, 3])
        baked, _ = room.bake(photons=300, sources=300)
    places = np.array([[4, 1.5, 6], [1, 1, 1], [5, 2, 7]], float)
    assert clamor._arguments.places(places, (3,)) is places
    with clamor.open(baked) as level:
        expected = clamor.impulse_responses(level, places, 0.05)
        from_floats = clamor.impulse_responses(level, places.astype(np.float32), 0.05)
        assert np.array_equal(from_floats, expected) and np.abs(expected).max() > 0.01
        grid = np.full((2, *expected.shape), np.nan, np.float32)
        assert clamor.impulse_responses(level, places, out=grid[1]).base is grid
        assert np.array_equal(grid[1], expected) and np.isnan(grid[0]).all()
        path = folder + "/responses.f32"
        mapped = np.memmap(path, np.float32, "w+", shape=expected.shape)
        assert clamor.impulse_responses(level, places, 0.05, out=mapped) is mapped
        del mapped
        assert np.array_equal(np.fromfile(path, np.float32).reshape(expected.shape), expected)

        spatial = clamor.spatial_impulse_responses(level, places, 0.05, "receivers")
        out = np.full(spatial.shape, np.nan, np.float32)
        assert clamor.spatial_impulse_responses(level, places, 0.05, "receivers", out=out) is out
        assert np.array_equal(out, spatial) and spatial.shape == (3, 2, 2400)
        # The mixer renders both, so the samples are the same in either order.
        walk = clamor.render_walk(level, places[1], 0.05, output="receivers", voices=level.info.sources)
        assert np.array_equal(walk.T, spatial[1])
        out = np.full(walk.shape, np.nan, np.float32)
        rendered = clamor.render_walk(level, places[1], out=out[:960], output="receivers",
                                      voices=level.info.sources)
        assert rendered.base is out and np.array_equal(rendered, walk[:960])
        assert np.isnan(out[960:]).all()

        frozen = np.empty(expected.shape, np.float32)
        frozen.flags.writeable = False
        for wrong in (np.empty(expected.shape), np.empty((2, 2400), np.float32), frozen, "out",
                      np.empty((6, 2400), np.float32)[::2], np.empty((2400, 3), np.float32).T):
            assert "out" in str(failure(clamor.impulse_responses, level, places, out=wrong, kind=ValueError))
        assert failure(clamor.impulse_responses, level, places, 0.04, out=expected, kind=ValueError)
        assert failure(clamor.render_walk, level, places[0], 0.04, out=walk, output="receivers", kind=ValueError)
        assert failure(clamor.spatial_impulse_responses, level, places, 0.04, "receivers", out=spatial, kind=ValueError)

        # 12 MB of samples take no more memory than the objects around them.
        responses, rows = np.empty((1, 3_000_000), np.float32), np.empty((1, 2, 48000), np.float32)
        assert peak_bytes(clamor.impulse_responses, level, places[:1], out=responses) < 200_000
        assert peak_bytes(clamor.spatial_impulse_responses, level, places[:1], 1, "receivers", out=rows) < 200_000

    with clamor.Context(caller_updates=True) as context, context.open(baked) as level:
        planes = np.full((2, 3000), np.nan, np.float32)
        listeners = [context.listen(level, places[0], output="receivers", offline=True) for _ in range(2)]
        for begin in range(0, 2400, 480):
            while any(listener.next_keyframe_s() is not None for listener in listeners):
                context.update()
            listeners[0].render_planar(out=planes[:, begin:begin + 480])
            assert np.array_equal(listeners[1].render(480).T, planes[:, begin:begin + 480])
        assert np.isnan(planes[:, 2400:]).all() and np.abs(planes[:, :2400]).max() > 1e-4
        for wrong in planes[:1], planes.astype(float), planes[:, ::2], planes.T:
            assert failure(listeners[0].render_planar, out=wrong, kind=ValueError)


def outside(level_path):
    """Listeners, places and sources outside of a level are told: as warnings, or to the log."""
    cheap = {"output": "receivers", "voices": 50}

    def warned(call, *arguments, **options):
        with warnings.catch_warnings(record=True) as told:
            warnings.simplefilter("always")
            call(*arguments, **options)
        assert all(one.category is clamor.ClamorWarning for one in told)
        return [str(one.message) for one in told]

    with clamor.open(level_path) as level:
        assert not warned(clamor.impulse_responses, level, [[0, 1.7, 3]], 0.01)
        measured, = warned(clamor.impulse_responses, level, [[0, 1.7, 3], [100, 1.7, 3], [101, 1, 3]], 0.01)
        assert "the receiver at 100,1.7,3 is outside the level" in measured
        heard, = warned(clamor.render_walk, level, [0, 40, 3], seconds=0.1, **cheap)
        assert level_path in heard and "the listener at 0,40,3 is outside the level" in heard
    told = []

    def play():
        with clamor.Context(caller_updates=True, log=told.append) as context:
            level = context.open(level_path)
            listener = context.listen(level, [0, 1.7, 3], **cheap)
            source = clamor.Source(context, clamor.Sound(context, np.ones(480)), [0, 1.7, -60])
            context.commit()
            for _ in range(3):
                context.update()
                listener.render(960)
            source.close()

    assert not warned(play)
    assert len(told) == 1 and "a source at 0,1.7,-60 is outside the level" in told[0]


if __name__ == "__main__":
    globals()[sys.argv[1]](*sys.argv[2:])
