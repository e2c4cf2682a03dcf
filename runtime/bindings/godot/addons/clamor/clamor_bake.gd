## A baked level: a [code].clamor[/code] file.
##
## It is what the Bake button or [code]clamor bake[/code] writes. It is read while it is heard, also from an
## exported game's archive, so that its size does not matter.
@tool
@icon("icons/bake.svg")
class_name ClamorBake
extends Resource
