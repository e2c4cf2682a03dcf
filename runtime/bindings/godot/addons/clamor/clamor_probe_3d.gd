## A place where the Bake button traces what a [ClamorSource3D] there would reflect.
##
## The bake chooses such places by itself, [member ClamorLevel3D.probe_spacing] apart. Add one where it matters: on a
## stage, in a niche.
@tool
@icon("icons/probe.svg")
class_name ClamorProbe3D
extends Node3D
