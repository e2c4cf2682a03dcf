## Lets Godot load [code].clamor[/code] files as [ClamorBake] resources, in exported games, too.
@tool
class_name ClamorBakeLoader
extends ResourceFormatLoader


func _get_recognized_extensions() -> PackedStringArray:
	return ["clamor"]


func _handles_type(type: StringName) -> bool:
	return type == &"Resource" or type == &"ClamorBake"


func _get_resource_type(path: String) -> String:
	return "Resource" if path.get_extension() == "clamor" else ""


func _get_resource_script_class(path: String) -> String:
	return "ClamorBake" if path.get_extension() == "clamor" else ""


func _load(path: String, _original_path: String, _use_sub_threads: bool, _cache_mode: int) -> Variant:
	return ClamorBake.new() if FileAccess.file_exists(path) else ERR_FILE_NOT_FOUND
