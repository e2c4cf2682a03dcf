"""reference.py MODE RATE ADDON HEARD: compares what a game heard with what the C interface renders.

MODE is one of the project's, RATE the mix rate, ADDON the add-on's folder, and HEARD the game's file of
stereo floats. The difference must be 100 dB below the sound, but only 45 dB where a door has turned: Godot
rounds angles to floats, and an error of 3e-8 of a part's orientation moves its edge past some of the sources,
which is 60 dB in the C interface itself.
"""
import os
import sys

import numpy as np

mode, rate, addon, heard_path = sys.argv[1], int(sys.argv[2]), sys.argv[3], sys.argv[4]
os.environ["CLAMOR_LIBRARY"] = os.path.join(addon, "bin", "libclamor.so.0")
sys.path.insert(0, os.path.join(os.path.dirname(__file__), "../../runtime/bindings/python"))
import clamor  # noqa: E402  (it looks for the library as it is imported)

PLACE = [0, 1.75, 1]
folder = os.path.dirname(heard_path)


def turned(position, degrees):
    half = np.radians(degrees) / 2
    return clamor.Pose(position, [0, np.sin(half), 0, np.cos(half)])


def render():
    level_file = os.path.join(folder, "portal.clamor" if mode in ("portal", "part") else "room.clamor")
    context = clamor.Context(caller_updates=True)
    level = context.open(level_file)
    keep = []
    if mode == "emitter":
        level.change_emitter(level.find_emitter("violin"), gain=0.5)
    elif mode == "portal":
        level.set_portal(level.find_portal("Opening"), 0.5)
    elif mode == "part":
        keep.append(level.find_part("lectern"))
        keep[0].move(clamor.Pose([0.5, 0.75, -1]))
    elif mode in ("door", "turned"):
        faces = np.fromfile(heard_path + ".faces", np.float32).reshape(-1, 3)
        keep.append(clamor.Part(context, vertices_m=faces, transmission=10 ** -1.5, absorption=0.1,
                                pose=turned([0.5, 1.25, -1], 45 if mode == "turned" else 0)))
    elif mode in ("source", "streamed"):
        level.change_emitter(level.find_emitter("violin"), is_muted=True)
        # Godot takes 32767 for full scale; its resampler drops the last six frames, and begins two frames late.
        # That is so at the rate of the mix, too. Sounds that are shared begin at once.
        samples = np.zeros(rate // 2, np.float32)
        samples[:-6] = (np.arange(rate // 2 - 6) * 7919 % 16384 - 8192) / 32767
        if mode == "streamed":
            samples = np.concatenate([np.zeros(2, np.float32), samples])
        at = 0

        def pull(out):
            nonlocal at
            block = samples[at:at + len(out)]
            out[:len(block)] = block
            at += len(block)
            return len(block)

        keep.append(clamor.Stream(context, rate_hz=rate, pull=pull) if mode == "streamed"
                    else clamor.Sound(context, samples, rate_hz=rate))
        keep.append(clamor.Source(context, keep[0], [-1, 1.5, 0], gain=0.5, directivity=1))
    context.commit()
    options = {"output": "loudspeakers", "layout": "5.1"} if mode == "surround" else {}
    ears = context.listen(level, PLACE, offline=True, rate_hz=rate, **options)
    blocks = []
    for _ in range(3 * rate // 512):
        while (time_s := ears.next_keyframe_s()) is not None:
            context.commit(time_s)
            context.update()
        blocks.append(ears.render(512))
    return np.concatenate(blocks)


reference = render().astype(float)
heard = np.fromfile(heard_path, np.float32).astype(float)
if mode == "surround":  # pairs of channels follow each other in blocks of Godot's
    blocks = heard[:len(heard) // 3072 * 3072].reshape(-1, 3, 512, 2)
    heard = blocks.transpose(0, 2, 1, 3).reshape(-1, 6)
else:
    heard = heard.reshape(-1, 2)


def first(sound):
    return np.flatnonzero(np.abs(sound).max(axis=1))[0]


heard = heard[first(heard) - first(reference):]
frames = min(len(heard), len(reference))
if frames < rate // 2:
    sys.exit(f"{mode} at {rate} Hz: only {frames} frames were heard")
error = np.sum((heard[:frames] - reference[:frames]) ** 2) / np.sum(reference[:frames] ** 2)
error_db = 10 * np.log10(error + 1e-30)
print(f"{mode} at {rate} Hz: {frames} frames differ by {error_db:.1f} dB")
sys.exit(bool(error_db > (-45 if mode == "turned" else -100)))
