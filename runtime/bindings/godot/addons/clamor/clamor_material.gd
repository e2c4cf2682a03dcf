## How a surface reflects sound, for the Bake button.
##
## A mesh or a material has one in its metadata entry [code]clamor_material[/code], or a [ClamorLevel3D]
## has it in its table of names.
@tool
@icon("icons/material.svg")
class_name ClamorMaterial
extends Resource

## The name of a preset, as [code]clamor materials[/code] lists them: brick, carpet, concrete, glass, wood ...
@export var preset := ""

## Share of the energy that is not reflected, for 63 Hz to 8 kHz: eight values, or one for all. Empty: the preset's.
@export var absorption: PackedFloat32Array = []

## Share of the reflected energy that is diffuse, as above.
@export var scattering: PackedFloat32Array = []

## Share of the energy that passes, at most the absorption, as above.
@export var transmission: PackedFloat32Array = []


## A material of values as glTF files (CLAMOR_materials_acoustic) and sidecars have them.
static func from_json(values: Dictionary) -> ClamorMaterial:
	var material := ClamorMaterial.new()
	material.preset = values.get("preset", "")
	for property: String in ["absorption", "scattering", "transmission"]:
		var bands: Variant = values.get(property, [])
		material.set(property, PackedFloat32Array(bands if bands is Array else [bands]))
	return material


## The values as a sidecar has them (LEVEL.acoustics.json).
func to_json() -> Dictionary:
	var values := {}
	if preset != "":
		values.preset = preset
	for property: String in ["absorption", "scattering", "transmission"]:
		var bands: PackedFloat32Array = get(property)
		if not bands.is_empty():
			values[property] = bands[0] if bands.size() == 1 else Array(bands)
	return values
