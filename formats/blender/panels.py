"""Panels in the object, material and scene properties."""

import textwrap

import bpy

from . import level_export, presets
from .session import current
from .summary import Summary, band_name

_QUANTITIES = ("absorption", "scattering", "transmission")


def draw_add_menu(self: bpy.types.Menu, _context: bpy.types.Context) -> None:
    self.layout.separator()
    self.layout.operator("clamor.add_emitter", icon="SPEAKER")


def _draw_sentence(
    layout: bpy.types.UILayout, context: bpy.types.Context, text: str, icon: str = "NONE"
) -> None:
    """Labels do not wrap by themselves."""
    letter_width = 7 * context.preferences.system.ui_scale
    columns = max(20, int(context.region.width / letter_width) - 8)
    column = layout.column(align=True)
    for i, line in enumerate(textwrap.wrap(text, columns)):
        column.label(text=line, icon=icon if i == 0 else "BLANK1")


class _InProperties:
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_options = {"DEFAULT_CLOSED"}


class OBJECT_PT_clamor_emitter(_InProperties, bpy.types.Panel):
    bl_label = "Sound Emitter"
    bl_context = "object"

    def draw_header(self, context: bpy.types.Context) -> None:
        self.layout.prop(context.object.clamor_emitter, "enabled", text="")

    def draw(self, context: bpy.types.Context) -> None:
        emitter = context.object.clamor_emitter
        layout = self.layout
        layout.active = emitter.enabled
        layout.template_ID(emitter, "sound", open="sound.open")
        layout.use_property_split = True
        layout.use_property_decorate = False  # a bake holds no animation
        column = layout.column()
        column.prop(emitter, "gain_db")
        column.prop(emitter, "loop")
        column = layout.column(align=True)
        column.prop(emitter, "delay_s")
        column.prop(emitter, "random_delay_s")
        layout.prop(emitter, "kind")
        if emitter.kind == "CONE":
            column = layout.column(align=True)
            column.prop(emitter, "cone_inner_angle")
            column.prop(emitter, "cone_outer_angle")
            column.prop(emitter, "cone_outer_gain")
            axis = "-Z" if context.object.type in {"CAMERA", "LIGHT"} else "+Y"
            layout.label(text=f"The cone opens along the local {axis} axis.", icon="INFO")
        elif emitter.kind == "GLOBAL":
            layout.label(text="Clamor bakes no emitters without position.", icon="INFO")


class MATERIAL_PT_clamor_acoustics(_InProperties, bpy.types.Panel):
    bl_label = "Acoustics"
    bl_context = "material"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return context.material is not None

    def draw_header(self, context: bpy.types.Context) -> None:
        self.layout.prop(context.material.clamor_acoustics, "enabled", text="")

    def draw(self, context: bpy.types.Context) -> None:
        acoustics = context.material.clamor_acoustics
        layout = self.layout
        if not acoustics.enabled:
            text = "Clamor takes the preset whose aliases match the name of this material."
            _draw_sentence(layout, context, text, "INFO")
            return
        row = layout.row(align=True)
        row.use_property_split = True
        row.use_property_decorate = False
        row.prop(acoustics, "preset", icon="MATERIAL")
        row.operator("clamor.copy_preset", text="", icon="GREASEPENCIL")
        preset = presets.presets().get(acoustics.preset)
        self._draw_table(acoustics, preset)
        if preset is None and not acoustics.use_absorption:
            text = "Choose a preset or set the absorption."
            _draw_sentence(layout, context, text, "ERROR")

    def _draw_table(self, acoustics: bpy.types.PropertyGroup, preset: presets.Preset | None) -> None:
        """A row for each band and a column for each quantity, the preset's values in grey."""
        table = self.layout.row(align=True)
        labels = table.column(align=True)
        labels.alignment = "RIGHT"
        labels.label(text="")
        for hz in presets.BANDS_HZ:
            labels.label(text=band_name(hz))
        for quantity in _QUANTITIES:
            column = table.column(align=True)
            column.prop(acoustics, "use_" + quantity)
            for band in range(len(presets.BANDS_HZ)):
                if getattr(acoustics, "use_" + quantity):
                    column.prop(acoustics, quantity, index=band, text="", slider=True)
                else:
                    cell = column.row()
                    cell.active = False
                    cell.alignment = "CENTER"
                    known = getattr(preset, quantity)[band] if preset else None
                    cell.label(text="" if known is None else f"{known:.2f}")


class SCENE_PT_clamor_bake(_InProperties, bpy.types.Panel):
    bl_label = "Clamor"
    bl_context = "scene"
    bl_options: set[str] = set()

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.layout
        settings = context.scene.clamor_bake
        column = layout.column()
        column.use_property_split = True
        column.use_property_decorate = False
        column.enabled = current.process is None
        column.prop(settings, "output")
        column.prop(settings, "until")
        counts = column.column(align=True)
        counts.active = not settings.until
        counts.prop(settings, "photons")
        counts.prop(settings, "sources")
        column.prop(settings, "seed")
        column.prop(settings, "material", text="Default Material")
        warning = level_export.unit_warning(context.scene)
        if warning:
            _draw_sentence(layout, context, warning, "ERROR")
        if current.process is None:
            layout.operator("clamor.bake", icon="RENDER_STILL")
        else:
            self._draw_progress(layout)
        if current.message:
            icon = "ERROR" if current.failed else "INFO"
            _draw_sentence(layout.box(), context, current.message, icon)
        if current.summary is not None:
            self._draw_summary(layout, context, current.summary)

    @staticmethod
    def _draw_progress(layout: bpy.types.UILayout) -> None:
        process = current.process
        text = f"{process.stage.capitalize()}: {100 * process.share:.0f} %"
        if process.seconds_left is not None:
            text += f", {process.seconds_left:.0f} s left"
        if process.cancelled:
            text = "Stopping"
        if hasattr(layout, "progress"):  # Blender 4.0 and later
            layout.progress(factor=process.share, text=text)
        else:
            layout.label(text=text, icon="SORTTIME")
        layout.operator("clamor.cancel_bake", icon="X")

    @staticmethod
    def _draw_summary(
        layout: bpy.types.UILayout, context: bpy.types.Context, summary: Summary
    ) -> None:
        box = layout.box()
        rows = box.column(align=True)
        for name, value in summary.facts:
            split = rows.split(factor=0.4)
            split.label(text=name)
            split.label(text=value)
        if all(t30_s is None for t30_s in summary.t30_s):
            text = "T30 was not measured: the room is too dry, or there are too few photons."
            _draw_sentence(box, context, text)
        else:
            SCENE_PT_clamor_bake._draw_decay(box, summary)
        for warning in summary.warnings:
            _draw_sentence(box, context, warning, "ERROR")

    @staticmethod
    def _draw_decay(box: bpy.types.UILayout, summary: Summary) -> None:
        box.label(text="Reverberation time (T30), s")
        row = box.row(align=True)
        for hz, t30_s in zip(summary.bands_hz, summary.t30_s):
            cell = row.column(align=True)
            cell.label(text=band_name(hz).replace(" Hz", "").replace(" kHz", "k"))
            cell.label(text="-" if t30_s is None else f"{t30_s:.2g}")


CLASSES = (OBJECT_PT_clamor_emitter, MATERIAL_PT_clamor_acoustics, SCENE_PT_clamor_bake)
