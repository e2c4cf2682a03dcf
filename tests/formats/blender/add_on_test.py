"""Tests of the Blender add-on as a user has it: packed, installed, and run in Blender.

Blender exports and bakes a hall, and `clamor inspect` tells what arrived. `run` starts this script.
"""

import json
import runpy
import subprocess
import sys
import time
import unittest
import warnings
from pathlib import Path

import bpy

sys.dont_write_bytecode = True  # the source tree stays as it is
HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))
CLAMOR, FOLDER = sys.argv[-2], Path(sys.argv[-1])
MODULE = "clamor_blender"


def install() -> None:
    package = FOLDER / f"{MODULE}.zip"
    source = HERE.parents[2] / "formats" / "blender" / "package.py"
    runpy.run_path(str(source))["write_package"](package)
    bpy.ops.preferences.addon_install(filepath=str(package))
    bpy.ops.preferences.addon_enable(module=MODULE)
    set_program(CLAMOR)


def set_program(program: str) -> None:
    bpy.context.preferences.addons[MODULE].preferences.program = program


def contents_of(bake: Path) -> dict:
    done = subprocess.run([CLAMOR, "inspect", "--json", bake], capture_output=True, check=True)
    return json.loads(done.stdout)


def session():
    return sys.modules[MODULE + ".session"].current


class BakedHall(unittest.TestCase):
    """Clamor reads what was set in Blender."""

    @classmethod
    def setUpClass(cls) -> None:
        hall.build(FOLDER)
        bpy.ops.wm.save_as_mainfile(filepath=str(FOLDER / "hall.blend"))
        bpy.ops.clamor.bake()
        cls.baked = contents_of(FOLDER / "hall.clamor")
        cls.level = (FOLDER / "hall_level.glb").read_bytes()

    def emitters(self, name: str) -> list[dict]:
        return [e for e in self.baked["emitters"] if e["name"] == name]

    def material(self, name: str) -> dict:
        return next(m for m in self.baked["materials"] if m["name"] == name)

    def assert_values(self, values: list[float], expected: list[float]) -> None:
        # Positions, gains and materials are stored in single precision, and gltf_values rounds
        # to six digits.
        for value, wanted in zip(values, expected, strict=True):
            self.assertAlmostEqual(value, wanted, places=5)

    def test_has_the_cone_where_it_stands_and_faces(self) -> None:
        (bell,) = self.emitters("Bell")
        # Blender's (x, y, z) is (x, z, -y) in glTF.
        self.assert_values(bell["position_m"], [1, 1.5, -2])
        self.assert_values(bell["axis"], [1, 0, 0])
        self.assertAlmostEqual(bell["gain"], 10 ** (-6 / 20), places=5)
        self.assertGreater(min(bell["directivity"]), 1)

    def test_has_the_lamp_that_hums_in_the_direction_of_its_light(self) -> None:
        (lamp,) = self.emitters("Lamp")
        self.assert_values(lamp["position_m"], [0, 2.5, -4])
        self.assert_values(lamp["axis"], [0, -1, 0])

    def test_has_the_child_where_its_parent_takes_it(self) -> None:
        (hum,) = self.emitters("Hum")
        self.assert_values(hum["position_m"], [-2, 1, -1])
        self.assertEqual(hum["gain"], 1)
        self.assertEqual(max(hum["directivity"]), 0)
        self.assertAlmostEqual(hum["delay_s"], 0.5, places=5)

    def test_has_the_contents_of_a_collection_at_each_instance(self) -> None:
        self.assertEqual(self.baked["geometry"]["triangles"], 6 * 2 + 2)
        fans = sorted(self.emitters("Fan"), key=lambda fan: fan["position_m"][0])
        self.assertEqual(len(fans), 2)
        self.assert_values(fans[0]["position_m"], [-3, 1, 4])
        self.assert_values(fans[1]["position_m"], [3, 1, 4])
        for fan in fans:
            self.assertAlmostEqual(fan["gain"], 10 ** (6 / 20), places=5)

    def test_leaves_out_the_global_emitter_and_says_so(self) -> None:
        self.assertEqual(len(self.baked["emitters"]), 5)
        self.assertEqual(self.emitters("Music"), [])
        self.assertRegex(" ".join(self.baked["warnings"]), "global emitter . 'bell.wav'")

    def test_has_the_absorption_that_was_set_per_band(self) -> None:
        screen = self.material("Screen")
        self.assert_values(screen["absorption"], hall.CURTAIN_ABSORPTION)
        self.assert_values(screen["scattering"], hall.CURTAIN_SCATTERING)
        self.assert_values(screen["transmission"], hall.CURTAIN_TRANSMISSION)

    def test_has_presets_and_what_overrides_them(self) -> None:
        presets = json.loads((HERE.parents[2] / "assets" / "materials.json").read_text())
        of = presets["materials"]
        self.assert_values(self.material("North")["absorption"], of["brick"]["absorption"])
        self.assert_values(self.material("North")["scattering"], of["brick"]["scattering"])
        self.assert_values(self.material("Stage")["absorption"], of["wood"]["absorption"])
        self.assert_values(self.material("Stage")["scattering"], [0.9] * 8)
        self.assert_values(self.material("Marble floor")["absorption"], of["marble"]["absorption"])

    def test_stores_each_sound_once_with_its_loop(self) -> None:
        size = int.from_bytes(self.level[12:16], "little")
        document = json.loads(self.level[20 : 20 + size])
        audio = document["extensions"]["KHR_audio_emitter"]
        self.assertEqual(sorted(sound["name"] for sound in audio["audio"]), ["bell.wav", "hum.wav"])
        self.assertEqual({sound["mimeType"] for sound in audio["audio"]}, {"audio/wav"})
        by_name = {node["name"]: node for node in document["nodes"]}
        (index,) = by_name["Hum"]["extensions"]["KHR_audio_emitter"]["emitters"]
        (source,) = audio["emitters"][index]["sources"]
        self.assertFalse(audio["sources"][source]["loop"])
        self.assertEqual(audio["audio"][audio["sources"][source]["audio"]]["name"], "hum.wav")
        self.assertIn("KHR_audio_emitter", document["extensionsUsed"])
        self.assertNotIn("KHR_audio_emitter", document.get("extensionsRequired", []))

    def test_is_summarised_for_the_panel(self) -> None:
        facts = dict(session().summary.facts)
        self.assertEqual(facts["Emitters"], "5")
        self.assertEqual(facts["Photons"], str(self.baked["photons"]["traced"]))
        self.assertEqual(list(session().summary.t30_s), self.baked["decay"]["t30_s"])
        self.assertEqual(list(session().summary.warnings), self.baked["warnings"])

    def test_takes_photons_and_seed_of_the_scene(self) -> None:
        self.assertEqual(self.baked["settings"]["seed"], 7)
        self.assertIn("--photons 200", self.baked["provenance"]["command"])

    def test_has_the_same_level_after_the_scene_is_reopened(self) -> None:
        bpy.ops.wm.open_mainfile(filepath=str(FOLDER / "hall.blend"))
        self.assertEqual(bpy.context.scene.clamor_bake.seed, 7)
        again = FOLDER / "again_level.glb"
        sys.modules[MODULE + ".level_export"].export_level(bpy.context.scene, again)
        self.assertEqual(again.read_bytes(), self.level)

    def test_writes_nothing_when_it_is_cancelled(self) -> None:
        output = FOLDER / "cancelled.clamor"
        options = ["-o", str(output), "--photons", "100000000", "--no-journal"]
        process = sys.modules[MODULE + ".bake_process"].BakeProcess(
            [CLAMOR, "bake", str(FOLDER / "hall_level.glb"), *options]
        )
        while process.stage != "tracing":
            self.assertFalse(process.poll(), "a hundred million photons take hours")
            time.sleep(0.01)
        self.assertTrue(0 <= process.share < 1)
        process.cancel()
        while not process.poll():
            time.sleep(0.01)
        self.assertFalse(process.succeeded)
        self.assertEqual(process.complaint, "stopped; nothing was written")
        self.assertFalse(output.exists())


class Settings(unittest.TestCase):
    """What is set is taken as it is meant."""

    def test_an_output_beside_the_blend_file_is_set_without_a_warning(self) -> None:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            bpy.context.scene.clamor_bake.output = "//beside.clamor"
        self.assertEqual(bpy.context.scene.clamor_bake.output, "//beside.clamor")


class Mistakes(unittest.TestCase):
    """A bake that cannot be made says why."""

    def setUp(self) -> None:
        hall.build(FOLDER)
        bpy.context.scene.clamor_bake.output = str(FOLDER / "mistake.clamor")
        self.addCleanup(set_program, CLAMOR)

    def assert_refused(self, words: str) -> None:
        with self.assertRaisesRegex(RuntimeError, words):
            bpy.ops.clamor.bake()
        self.assertRegex(session().message, words)
        self.assertFalse((FOLDER / "mistake.clamor").exists())

    def test_an_unknown_preset_is_answered_with_clamors_sentence(self) -> None:
        bpy.data.materials["North"].clamor_acoustics.preset = "brik"
        self.assert_refused("material 'North'.*'brik'.*brick")

    def test_an_emitter_without_sound_is_named(self) -> None:
        bpy.data.objects["Bell"].clamor_emitter.sound = None
        self.assert_refused("'Bell' is a sound emitter without a sound")

    def test_a_missing_sound_file_is_named(self) -> None:
        bpy.data.sounds["bell.wav"].filepath = str(FOLDER / "gone.wav")
        self.assert_refused("'Bell': the sound file .*gone.wav is missing")

    def test_a_missing_program_is_named_with_the_place_to_set_it(self) -> None:
        set_program("clamour")
        self.assert_refused("'clamour' was not found.*Preferences")

    def test_an_unsaved_scene_is_not_baked_beside_nothing(self) -> None:
        bpy.context.scene.clamor_bake.output = "//mistake.clamor"
        self.assert_refused("Save the .blend file first")


install()
import hall  # noqa: E402: it uses the properties of the add-on

outcome = unittest.TextTestRunner(verbosity=2).run(
    unittest.defaultTestLoader.loadTestsFromModule(sys.modules[__name__])
)
if not outcome.wasSuccessful():
    raise RuntimeError("tests of the add-on failed")
