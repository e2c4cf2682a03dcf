"""Operators behind the buttons: add an emitter, copy a preset, bake, cancel."""

import time

import bpy

from . import level_export, presets
from .bake_process import BakeProcess, ClamorError, run_inspect
from .preferences import program
from .session import current
from .summary import summary_of

_TICK_S = 0.1


class CLAMOR_OT_add_emitter(bpy.types.Operator):
    """Add an empty that emits a sound"""

    bl_idname = "clamor.add_emitter"
    bl_label = "Sound Emitter"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return context.mode == "OBJECT"

    def execute(self, context: bpy.types.Context) -> set[str]:
        emitter = bpy.data.objects.new("Emitter", None)
        # Like the cone of an emitter, the tip of this empty points along +Y.
        emitter.empty_display_type = "CONE"
        emitter.empty_display_size = 0.3
        emitter.location = context.scene.cursor.location
        emitter.clamor_emitter.enabled = True
        context.collection.objects.link(emitter)
        for selected in context.selected_objects:
            selected.select_set(False)
        emitter.select_set(True)
        context.view_layer.objects.active = emitter
        return {"FINISHED"}


class CLAMOR_OT_copy_preset(bpy.types.Operator):
    """Copy the values of the preset, to change them"""

    bl_idname = "clamor.copy_preset"
    bl_label = "Edit Values of Preset"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        material = getattr(context, "material", None)
        return material is not None and material.clamor_acoustics.preset in presets.presets()

    def execute(self, context: bpy.types.Context) -> set[str]:
        acoustics = context.material.clamor_acoustics
        preset = presets.presets()[acoustics.preset]
        for quantity in ("absorption", "scattering", "transmission"):
            setattr(acoustics, quantity, getattr(preset, quantity))
            setattr(acoustics, "use_" + quantity, any(getattr(preset, quantity)))
        return {"FINISHED"}


class CLAMOR_OT_bake(bpy.types.Operator):
    """Export the scene as a level and bake its acoustics"""

    bl_idname = "clamor.bake"
    bl_label = "Bake Acoustics"

    _timer: bpy.types.Timer | None = None

    @classmethod
    def poll(cls, _context: bpy.types.Context) -> bool:
        return current.process is None

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Bakes while the caller waits: for scripts and for Blender in the background."""
        if not self._begin(context):
            return {"CANCELLED"}
        process = current.process
        shown = -1
        while not process.poll():
            percent = int(100 * process.share)
            if percent // 10 > shown // 10:
                print(f"Clamor: {process.stage}, {percent} %")
                shown = percent
            time.sleep(_TICK_S / 2)
        return self._end(process)

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        """Bakes beside Blender, which stays usable."""
        if not self._begin(context):
            return {"CANCELLED"}
        manager = context.window_manager
        self._process = current.process
        self._timer = manager.event_timer_add(_TICK_S, window=context.window)
        manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        if event.type != "TIMER":
            return {"PASS_THROUGH"}
        _redraw(context)
        if not self._process.poll():
            return {"PASS_THROUGH"}
        context.window_manager.event_timer_remove(self._timer)
        return self._end(self._process)

    def cancel(self, context: bpy.types.Context) -> None:
        """Blender calls this when it quits or opens another file."""
        context.window_manager.event_timer_remove(self._timer)
        current.stop()

    def _begin(self, context: bpy.types.Context) -> bool:
        scene = context.scene
        try:
            clamor = program(context)
            self._output = level_export.output_path(scene)
            level = level_export.level_path(self._output)
            level_export.check(scene)
            level_export.export_level(scene, level)
            command = level_export.bake_command(clamor, scene, level, self._output)
            current.begin(BakeProcess(command))
        except ClamorError as error:
            self._fail(str(error))
            return False
        self._program = clamor
        return True

    def _end(self, process: BakeProcess) -> set[str]:
        if process.cancelled:
            current.fail(process.complaint, failed=False)
            self.report({"INFO"}, process.complaint)
            return {"CANCELLED"}
        if not process.succeeded:
            return self._fail(process.complaint)
        try:
            current.end(summary_of(run_inspect(self._program, self._output)))
        except ClamorError as error:
            return self._fail(str(error))
        for warning in process.warnings:
            self.report({"WARNING"}, warning)
        self.report({"INFO"}, f"Baked {self._output}")
        return {"FINISHED"}

    def _fail(self, sentence: str) -> set[str]:
        current.fail(sentence)
        self.report({"ERROR"}, sentence)
        return {"CANCELLED"}


class CLAMOR_OT_cancel_bake(bpy.types.Operator):
    """Stop the bake; the next one continues from the paths that were traced"""

    bl_idname = "clamor.cancel_bake"
    bl_label = "Cancel"

    @classmethod
    def poll(cls, _context: bpy.types.Context) -> bool:
        return current.process is not None and not current.process.cancelled

    def execute(self, _context: bpy.types.Context) -> set[str]:
        current.process.cancel()
        return {"FINISHED"}


def _redraw(context: bpy.types.Context) -> None:
    for window in context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "PROPERTIES":
                area.tag_redraw()


CLASSES = (CLAMOR_OT_add_emitter, CLAMOR_OT_copy_preset, CLAMOR_OT_bake, CLAMOR_OT_cancel_bake)
