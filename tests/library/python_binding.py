"""Checks of the Python package that python_binding_test.cpp runs: python_binding.py CHECK ARGUMENT..."""
import ctypes
import gc
import json
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


if __name__ == "__main__":
    globals()[sys.argv[1]](*sys.argv[2:])
