## Takes over the acoustic materials (CLAMOR_materials_acoustic) of glTF files that are imported, as Clamor's add-on for
## Blender writes them, into the metadata of Godot's materials.
@tool
extends GLTFDocumentExtension


func _get_supported_extensions() -> PackedStringArray:
	return ["CLAMOR_materials_acoustic"]


func _import_post_parse(state: GLTFState) -> Error:
	var written: Array = state.json.get("materials", [])
	for i in mini(written.size(), state.materials.size()):
		var values: Variant = written[i].get("extensions", {}).get("CLAMOR_materials_acoustic")
		if values is Dictionary and not values.has("bandsHz"):
			state.materials[i].set_meta("clamor_material", ClamorMaterial.from_json(values))
	return OK
