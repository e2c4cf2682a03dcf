## The editor's part of the add-on: the Bake button, the dock with what the bake found, and gizmos.
@tool
extends EditorPlugin

const Baker := preload("baker.gd")
const Dock := preload("dock.gd")
const Gizmos := preload("gizmos.gd")
const Import := preload("import.gd")

var _baker := Baker.new()
var _dock := Dock.new()
var _gizmos := Gizmos.new()
var _import := Import.new()
var _button := Button.new()
var _quality := OptionButton.new()


func _enter_tree() -> void:
	_button.flat = true
	_button.pressed.connect(_press)
	_quality.flat = true
	for quality: String in Baker.QUALITIES:
		_quality.add_item(quality)
	_quality.tooltip_text = "Quality of the bake of the scene's acoustics."
	_baker.changed.connect(_show_state)
	_baker.baked.connect(_take)
	add_control_to_container(CONTAINER_SPATIAL_EDITOR_MENU, _button)
	add_control_to_container(CONTAINER_SPATIAL_EDITOR_MENU, _quality)
	_dock.name = "Clamor"
	_dock.node_chosen.connect(_select)
	add_control_to_dock(DOCK_SLOT_RIGHT_BL, _dock)
	add_node_3d_gizmo_plugin(_gizmos)
	GLTFDocument.register_gltf_document_extension(_import)
	_show_state()


func _exit_tree() -> void:
	_baker.cancel()
	remove_control_from_container(CONTAINER_SPATIAL_EDITOR_MENU, _button)
	remove_control_from_container(CONTAINER_SPATIAL_EDITOR_MENU, _quality)
	remove_control_from_docks(_dock)
	remove_node_3d_gizmo_plugin(_gizmos)
	GLTFDocument.unregister_gltf_document_extension(_import)
	_button.queue_free()
	_quality.queue_free()
	_dock.queue_free()


func _process(_delta: float) -> void:
	_baker.poll()


func _press() -> void:
	if _baker.is_baking():
		_baker.cancel()
	else:
		_baker.bake(EditorInterface.get_edited_scene_root(), _quality.get_item_text(_quality.selected))


func _show_state() -> void:
	_button.text = "Cancel (%d %%)" % roundi(100 * _baker.fraction) if _baker.is_baking() else "Bake"
	_button.tooltip_text = "Bakes the acoustics of the edited scene."
	_dock.show_findings(_baker.findings)


# The level of the edited scene gets the bake, which can be undone.
func _take(level: ClamorLevel3D, bake: ClamorBake) -> void:
	EditorInterface.get_resource_filesystem().scan()
	if level.bake == bake:
		return
	var undo := get_undo_redo()
	undo.create_action("Bake acoustics")
	undo.add_do_property(level, "bake", bake)
	undo.add_undo_property(level, "bake", level.bake)
	undo.commit_action()


func _select(node: Node) -> void:
	EditorInterface.get_selection().clear()
	EditorInterface.get_selection().add_node(node)
	EditorInterface.edit_node(node)
