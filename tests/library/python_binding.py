"""Checks of the Python package that python_binding_test.cpp runs: python_binding.py CHECK ARGUMENT..."""
import ctypes
import gc
import json
import subprocess
import sys
import threading

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


def declared_table(module):
    """The lines of header_table.h for what a module declares."""
    lines = set()
    for name, value in vars(module).items():
        if name.startswith("CLAMOR_") and isinstance(value, int):
            lines.add(f"constant {name} {value}")
        elif name.startswith("clamor_") and isinstance(value, type):
            lines.add(f"struct {name} {ctypes.sizeof(value)}")
            for member, _ in value._fields_:
                place = getattr(value, member)
                lines.add(f"member {name} {member} {place.offset} {place.size}")
    for name, (result, arguments) in module.SIGNATURES.items():
        lines.add(" ".join(["function", name, *map(kind, [result, *arguments])]))
    return lines


def interface(module_name, table):
    """The package declares all of a header, with its values, sizes, offsets and types."""
    module = __import__("clamor." + module_name, fromlist=["*"])
    declared = declared_table(module)
    with open(table, encoding="ascii") as file:
        header = {line.strip() for line in file}
    versions = {line for line in header if "_VERSION_M" in line or "_VERSION_P" in line}
    for line in sorted(header - versions - declared):
        print("clamor.h has, and the package has not:", line)
    for line in sorted(declared - header):
        print("the package has, and clamor.h has not:", line)
    assert len(header) > 50 and header - versions == declared


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
        assert failure(clamor.render_walk, level, at, output="quadraphonic", kind=ValueError)
        assert failure(clamor.render_walk, level, at, rate_hz=7).code == -1

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
        assert failure(listener.move, [float("nan"), 0, 0]).code == -1
        listener.close()
        listener.close()
        assert failure(listener.render, 16).code == -2
    assert failure(listener.render, 16, kind=ValueError)
    gc.collect()
    assert not sys.modules["clamor.world"]._read_by_library, "bytes are kept that nothing reads"


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
        baked, report = room.bake(photons=1000, sources=1000)
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
        responses = clamor.impulse_responses(level, places, seconds=0.05)
        assert responses.shape == (3, 2400) and responses.dtype == np.float32
        distance_m = np.linalg.norm(places - emitter, axis=1)
        # The speed of sound is 343.2 m/s, and the impulse is a sinc of sum 1.
        assert np.abs(np.abs(responses).argmax(1) - distance_m / 343.2 * 48000).max() < 1
        assert np.abs(responses.sum(1) * distance_m - 1).max() < 0.001
        pairs = clamor.impulse_responses(level, places[:2], 0.05, "receivers", threads=1)
        assert pairs.shape == (2, 2, 2400)
        assert failure(clamor.impulse_responses, level, places[0], kind=ValueError)

    path = folder + "/box.clamor"
    box(0.3, path=path, photons=3000, sources=1000)
    subprocess.run(["clamor", "impulse", path, "-o", folder + "/ir.wav", "--listener", "4,1.5,6",
                    "--strategy", "all"], check=True, capture_output=True)
    with open(folder + "/ir.wav", "rb") as file:
        data = file.read()
    expected = np.frombuffer(data[data.index(b"data") + 8:], "<f4").astype(float)
    with clamor.open(path) as level:
        response = clamor.impulse_responses(level, places[:1], 0.4)[0].astype(float)
    for begin in (0, 2400, 7200):  # both give each arrival a sign of its own
        decibels = 10 * np.log10((response[begin:] ** 2).sum() / (expected[begin:] ** 2).sum())
        assert abs(decibels) < 2, (begin, decibels)


if __name__ == "__main__":
    globals()[sys.argv[1]](*sys.argv[2:])
