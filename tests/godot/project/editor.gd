# A plugin that edits scene.tscn in Godot's editor, where `-- check_editor` asks for it: each property of each Clamor
# node is changed, undone and redone, nodes are duplicated, a bake is taken and undone, and all of it saved and loaded.
# Each node but the level has a gizmo.
@tool
extends EditorPlugin

var changed := 0


func _enter_tree() -> void:
	if OS.get_cmdline_user_args() == PackedStringArray(["check_editor"]):
		_check.call_deferred()


func _check() -> void:
	while EditorInterface.get_resource_filesystem().is_scanning():
		await get_tree().process_frame
	# The editor opens the main scene by itself, sooner or later.
	var root: Node
	for i in 200:
		if i % 20 == 10:
			EditorInterface.open_scene_from_path("res://scene.tscn")
		await get_tree().process_frame
		root = EditorInterface.get_edited_scene_root()
		if i > 40 and root != null and root.scene_file_path == "res://scene.tscn":
			break
	if root == null or root.scene_file_path != "res://scene.tscn":
		printerr("the scene does not open")
		get_tree().quit(1)
		return
	var is_right := true
	for node in root.find_children("*", "", true, false):
		if node.get_script() != null:
			is_right = _change_and_undo(node) and is_right
			is_right = _duplicate(node, root) and is_right
			is_right = _is(node is ClamorLevel3D or _has_gizmo(node), "%s has no gizmo" % node.name) and is_right
	is_right = _take_bake(root) and is_right
	is_right = _choose_finding(root) and is_right
	is_right = _check_warnings() and is_right
	is_right = await _read_help() and is_right
	var values := _all_values(root)
	var packed := PackedScene.new()
	packed.pack(root)
	ResourceSaver.save(packed, "res://edited.tscn")
	var saved: Node = ResourceLoader.load("res://edited.tscn", "", ResourceLoader.CACHE_MODE_IGNORE).instantiate()
	is_right = _is(_all_values(saved) == values, "the saved scene is another") and is_right
	saved.free()
	DirAccess.remove_absolute("res://edited.tscn")
	print("%d properties were changed and undone" % changed)
	get_tree().quit(0 if is_right and changed > 30 else 1)


func _change_and_undo(node: Node) -> bool:
	var undo := get_undo_redo()
	for property in _properties(node):
		var before: Variant = node.get(property.name)
		var after: Variant = before
		match property.type:
			TYPE_BOOL: after = not before
			TYPE_INT: after = before + 1
			TYPE_FLOAT: after = before + 0.25
			TYPE_STRING, TYPE_STRING_NAME: after = before + "x"
			TYPE_VECTOR2: after = before + Vector2.ONE
			_: continue
		undo.create_action("Change")
		undo.add_do_property(node, property.name, after)
		undo.add_undo_property(node, property.name, before)
		undo.commit_action()
		var history := undo.get_history_undo_redo(undo.get_object_history_id(node))
		var is_right: bool = node.get(property.name) == after
		history.undo()
		is_right = is_right and node.get(property.name) == before
		history.redo()
		if not _is(is_right and node.get(property.name) == after, "%s.%s" % [node.name, property.name]):
			return false
		changed += 1
	return true


func _duplicate(node: Node, root: Node) -> bool:
	var copy := node.duplicate()
	node.get_parent().add_child(copy, true)
	copy.owner = root
	return _is(_values(copy) == _values(node), "the copy of %s is another" % node.name)


func _has_gizmo(node: Node3D) -> bool:
	return node.get_gizmos().any(func(gizmo: EditorNode3DGizmo) -> bool:
		return gizmo.get_plugin().get_script() != null and gizmo.get_plugin().get_script().resource_path.ends_with("clamor/editor/gizmos.gd"))


func _take_bake(root: Node) -> bool:
	var level: ClamorLevel3D = root.get_node("Level")
	var before := level.bake
	_addon().call("_take", level, load("res://room.clamor"))
	var history := get_undo_redo().get_history_undo_redo(get_undo_redo().get_object_history_id(level))
	var is_right := level.bake != null and level.bake.resource_path == "res://room.clamor"
	history.undo()
	is_right = is_right and level.bake == before
	history.redo()
	return _is(is_right and level.bake.resource_path == "res://room.clamor", "a bake cannot be undone")


# A click on a line of the dock selects the node that the line is about.
func _choose_finding(root: Node) -> bool:
	var dock: Tree = _addon().get("_dock")
	var findings: Array[Array] = [["A finding without a node", null], ["A finding", root.get_node("Floor")]]
	dock.call("show_findings", findings)
	dock.get_root().get_child(1).select(0)
	var selected := EditorInterface.get_selection().get_selected_nodes()
	return _is(selected == [root.get_node("Floor")], "a finding selects %s" % [selected])


func _addon() -> EditorPlugin:
	for plugin in get_tree().root.find_children("*", "EditorPlugin", true, false):
		if plugin.get_script() != null and plugin.get_script().resource_path.ends_with("clamor/editor/plugin.gd"):
			return plugin
	return null


# What the scene tree says of nodes that lack something, and that it says nothing once that is there.
func _check_warnings() -> bool:
	var level := ClamorLevel3D.new()
	var is_right := _warns(level, "There is no bake yet")
	level.bake = ClamorBake.new()
	is_right = _warns(level, "a file of its own") and is_right
	level.bake = load("res://room.clamor")
	is_right = _warns(level) and is_right
	var source := ClamorSource3D.new()
	is_right = _warns(source) and is_right
	source.autoplay = true
	is_right = _warns(source, "no stream") and is_right
	source.stream = AudioStreamGenerator.new()
	is_right = _warns(source) and is_right
	var emitter := ClamorEmitter3D.new()
	is_right = _warns(emitter, "no stream") and is_right
	emitter.stream = source.stream
	is_right = _warns(emitter) and is_right
	var listener := ClamorListener3D.new()
	is_right = _warns(listener) and is_right
	listener.scale *= 2
	is_right = _warns(listener, "scaled") and is_right
	var leaf := MeshInstance3D.new()
	var door := ClamorDoor3D.new()
	is_right = _warns(door, "Leaf") and is_right
	leaf.add_child(door)
	is_right = _warns(door, "no meshes") and is_right
	leaf.mesh = BoxMesh.new()
	is_right = _warns(door) and is_right
	var portal := ClamorPortal3D.new()
	is_right = _warns(portal) and is_right
	portal.mode = ClamorPortal3D.Mode.ANGLE
	is_right = _warns(portal, "property Door") and is_right
	portal.door = leaf
	is_right = _warns(portal) and is_right
	for node: Node in [level, source, emitter, listener, leaf, portal]:
		node.free()
	return is_right


# Whether a node has one warning that contains a text, or none.
func _warns(node: Node, text := "") -> bool:
	var warnings: PackedStringArray = node.call("_get_configuration_warnings")
	var is_right := warnings.is_empty() if text == "" else warnings.size() == 1 and text in warnings[0]
	return _is(is_right, "%s warns of %s, wanted '%s'" % [node.get_script().resource_path, warnings, text])


# F1 of the class that is not a script.
func _read_help() -> bool:
	var editor := EditorInterface.get_script_editor()
	editor.goto_help("class_name:ClamorServer")
	for i in 100:
		await get_tree().process_frame
		for page in editor.find_children("ClamorServer", "EditorHelp", true, false):
			for text: RichTextLabel in page.find_children("*", "RichTextLabel", true, false):
				if text.get_parsed_text().contains("Opens a bake in the background"):
					return true
	return _is(false, "ClamorServer has no help")


# What the script of a node exports.
func _properties(node: Node) -> Array[Dictionary]:
	return node.get_property_list().filter(func(property: Dictionary) -> bool:
		return property.usage & PROPERTY_USAGE_SCRIPT_VARIABLE and property.usage & PROPERTY_USAGE_STORAGE)


func _values(node: Node) -> Array:
	return _properties(node).map(func(property: Dictionary) -> String:
		return property.name + "=" + var_to_str(node.get(property.name) if property.type != TYPE_OBJECT else
			str(node.get(property.name) == null)))


func _all_values(root: Node) -> Array:
	return root.find_children("*", "", true, false).filter(func(node: Node) -> bool: return node.get_script() != null) \
		.map(func(node: Node) -> Array: return [str(root.get_path_to(node))] + _values(node))


func _is(is_right: bool, otherwise: String) -> bool:
	if not is_right:
		printerr(otherwise)
	return is_right
