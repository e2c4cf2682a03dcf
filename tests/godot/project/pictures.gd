# Takes the pictures of the add-on's page, as an autoload of the demo: of the editor after a bake, and of the game, into
# the files that the user argument names.
@tool
extends Node


func _ready() -> void:
	var arguments := OS.get_cmdline_user_args()
	if arguments.size() == 1:
		_take.call_deferred(arguments[0])


func _take(file: String) -> void:
	if Engine.is_editor_hint():
		await _bake()
	else:
		var press := InputEventKey.new()
		press.physical_keycode = KEY_E
		press.pressed = true
		Input.parse_input_event(press)
		while get_tree().current_scene.get_node("Ears").get_statistics().voices == 0:
			await _frames(1)
		await _frames(90)
	get_tree().root.get_texture().get_image().save_png(file)
	get_tree().quit()


func _bake() -> void:
	while EditorInterface.get_resource_filesystem().is_scanning() or EditorInterface.get_edited_scene_root() == null:
		await _frames(20)
		EditorInterface.open_scene_from_path("res://demo.tscn")
	EditorInterface.set_main_screen_editor("3D")
	EditorInterface.edit_node(EditorInterface.get_edited_scene_root().get_node("violin"))
	await _frames(100)
	for plugin in get_tree().root.find_children("*", "EditorPlugin", true, false):
		if plugin.get_script() != null and plugin.get_script().resource_path.ends_with("clamor/editor/plugin.gd"):
			plugin._press()
			while plugin._baker.is_baking():
				await _frames(10)
	await _frames(60)


func _frames(count: int) -> void:
	for i in count:
		await get_tree().process_frame
