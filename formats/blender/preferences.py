"""The add-on's preferences: where the program `clamor` is."""

import bpy
from bpy.props import StringProperty

from .bake_process import ClamorError, find_program


class ClamorPreferences(bpy.types.AddonPreferences):
    bl_idname = __package__

    program: StringProperty(
        name="Program",
        description="The program clamor: a path, or a name that the system finds on its PATH",
        subtype="FILE_PATH",
        default="clamor",
    )

    def draw(self, _context: bpy.types.Context) -> None:
        layout = self.layout
        layout.use_property_split = True
        layout.prop(self, "program")
        try:
            layout.label(text=f"Found: {find_program(self.program)}", icon="CHECKMARK")
        except ClamorError:
            layout.label(text="There is no such program.", icon="ERROR")


def program(context: bpy.types.Context) -> str:
    """The path of the program. Raises ClamorError if it does not exist."""
    return find_program(context.preferences.addons[__package__].preferences.program)


CLASSES = (ClamorPreferences,)
