"""A small hall, built in Blender: six walls, emitters, and a collection with two instances."""

import math
import struct
import wave
from pathlib import Path

import bpy

CURTAIN_ABSORPTION = [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8]
CURTAIN_SCATTERING = [0.8, 0.7, 0.6, 0.5, 0.4, 0.3, 0.2, 0.1]
CURTAIN_TRANSMISSION = [0.1, 0.1, 0.1, 0.1, 0.05, 0.05, 0.0, 0.0]


def write_tone(path: Path, hz: float) -> None:
    samples = [int(8000 * math.sin(2 * math.pi * hz * i / 8000)) for i in range(800)]
    with wave.open(str(path), "wb") as sound:
        sound.setnchannels(1)
        sound.setsampwidth(2)
        sound.setframerate(8000)
        sound.writeframes(struct.pack(f"<{len(samples)}h", *samples))


def material(name: str, **acoustics: object) -> bpy.types.Material:
    made = bpy.data.materials.new(name)
    made.clamor_acoustics.enabled = bool(acoustics)
    for key, value in acoustics.items():
        setattr(made.clamor_acoustics, key, value)
    return made


def emitter(name: str, sound: bpy.types.Sound, **values: object) -> bpy.types.Object:
    """An empty; `location`, `rotation_euler` and `parent` are the object's own."""
    made = bpy.data.objects.new(name, None)
    made.clamor_emitter.enabled = True
    made.clamor_emitter.sound = sound
    for key, value in values.items():
        owner = made if key in {"location", "rotation_euler", "parent"} else made.clamor_emitter
        setattr(owner, key, value)
    return made


def box(materials: list[bpy.types.Material]) -> bpy.types.Object:
    """Walls from (-4, -5, 0) to (4, 5, 3), whose materials alternate."""
    corners = [(x, y, z) for x in (-4, 4) for y in (-5, 5) for z in (0, 3)]
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    mesh = bpy.data.meshes.new("Walls")
    mesh.from_pydata(corners, [], faces)
    for wall in materials:
        mesh.materials.append(wall)
    for i, face in enumerate(mesh.polygons):
        face.material_index = i % len(materials)
    return bpy.data.objects.new("Walls", mesh)


def build(folder: Path) -> None:
    """Replaces what is open."""
    bpy.ops.wm.read_homefile(use_empty=True)
    add = bpy.context.collection.objects.link
    for name, hz in (("bell", 440), ("hum", 100)):
        write_tone(folder / f"{name}.wav", hz)
    bell = bpy.data.sounds.load(str(folder / "bell.wav"))
    hum = bpy.data.sounds.load(str(folder / "hum.wav"))
    hum.pack()
    (folder / "hum.wav").unlink()

    curtain = material(
        "Screen",
        use_absorption=True,
        absorption=CURTAIN_ABSORPTION,
        use_scattering=True,
        scattering=CURTAIN_SCATTERING,
        use_transmission=True,
        transmission=CURTAIN_TRANSMISSION,
    )
    bare = [0.9] * 8
    stage = material("Stage", preset="wood", use_scattering=True, scattering=bare)
    add(box([material("North", preset="brick"), curtain, stage, material("Marble floor")]))

    # The tip of the cone, local +Y, is turned to face Blender's +X.
    add(
        emitter(
            "Bell",
            bell,
            kind="CONE",
            gain_db=-6.0,
            cone_inner_angle=math.radians(40),
            cone_outer_angle=math.radians(120),
            location=(1, 2, 1.5),
            rotation_euler=(0, 0, -math.pi / 2),
        )
    )
    lamp = bpy.data.objects.new("Lamp", bpy.data.lights.new("Lamp", "SPOT"))
    lamp.location = (0, 4, 2.5)
    lamp.clamor_emitter.enabled = True
    lamp.clamor_emitter.sound = hum
    lamp.clamor_emitter.kind = "CONE"
    add(lamp)

    cart = bpy.data.objects.new("Cart", None)
    cart.location = (-2, 0, 0)
    cart.rotation_euler = (0, 0, math.pi / 2)
    add(cart)
    add(emitter("Hum", hum, loop=False, delay_s=0.5, location=(1, 0, 1), parent=cart))
    add(emitter("Music", bell, kind="GLOBAL"))

    fan = bpy.data.collections.new("Fans")
    seat = bpy.data.meshes.new("Seat")
    seat.from_pydata([(-1, -1, 0.5), (1, -1, 0.5), (0, 1, 0.5)], [], [(0, 1, 2)])
    seat.materials.append(stage)
    fan.objects.link(bpy.data.objects.new("Seat", seat))
    fan.objects.link(emitter("Fan", hum, gain_db=6.0, location=(0, 0, 1)))
    for x in (-3, 3):
        instance = bpy.data.objects.new("Fans", None)
        instance.instance_type = "COLLECTION"
        instance.instance_collection = fan
        instance.location = (x, -4, 0)
        add(instance)
    settings = bpy.context.scene.clamor_bake
    settings.output = "//hall.clamor"
    settings.photons = 200
    settings.seed = 7
