## Opens a baked level, so that [ClamorListener3D] nodes hear it.
##
## The level is heard while this node is in the tree and [member active]. Where several are, the one that
## entered last is heard: listeners crossfade to it within a tenth of a second. Everything that sounds lies
## relative to this node as it lay when the level was baked, so the node may be moved, but not scaled. A game that is
## run from the editor opens a level again that is baked meanwhile.
@tool
@icon("icons/level.svg")
class_name ClamorLevel3D
extends Node3D

## The bake has been opened, or opened anew.
signal opened

## States of [method get_state].
enum State {
	CLOSED = -1,  ## There is no bake, or the node is not in the tree.
	OPENING = 0,  ## The bake is being opened in the background.
	OPEN = 1,  ## The bake can be heard.
	FAILED = 2,  ## The bake could not be opened; an error has said why.
}

## The baked level, a [code].clamor[/code] file.
@export var bake: ClamorBake:
	set(value):
		bake = value
		update_configuration_warnings()
		reopen()

## Whether listeners may hear this level.
@export var active := true

## Materials of surfaces for the Bake button, by the names of Godot's materials or meshes. A [code]*[/code]
## stands for any characters. A mesh or material with a [ClamorMaterial] of its own, in its metadata entry
## [code]clamor_material[/code], needs none, and neither does one whose name tells a preset, as Brick_Wall does.
@export var materials: Dictionary[String, ClamorMaterial] = {}

## Metres between places where the Bake button makes [ClamorSource3D] nodes reverberate. 0: the bake chooses.
@export_range(0, 50, 0.1, "suffix:m") var probe_spacing := 0.0

## Layers of [member VisualInstance3D.layers] whose meshes are surfaces of the bake.
@export_flags_3d_render var bake_layers := 0xfffff

static var _levels: Array[ClamorLevel3D] = []

# The level's number in ClamorServer; 0: it is closed.
var _number := 0
var _is_open := false
var _baked_s := 0  # when the bake's file was written, and when that was looked at
var _looked_ms := 0


## The level that is heard now, or null.
static func get_current() -> ClamorLevel3D:
	for i in range(_levels.size() - 1, -1, -1):
		if _levels[i].active and _levels[i].get_state() < State.FAILED and _levels[i]._number != 0:
			return _levels[i]
	return null


## Where something lies in the level that is heard, as far as Clamor is concerned.
static func to_level(place: Transform3D) -> Transform3D:
	var level := get_current()
	return place if level == null else level.global_transform.orthonormalized().affine_inverse() * place


# The level that is heard now, once its bake is open, or null.
static func _get_open() -> ClamorLevel3D:
	var level := get_current()
	return level if level != null and level.get_state() == State.OPEN else null


# Amplitude of a gain; -80 dB, the end of its range, is silence.
static func _gain(db: float) -> float:
	return db_to_linear(db) if db > -80 else 0.0


## What is known of the bake: whether it is open.
func get_state() -> State:
	return State.CLOSED if _number == 0 else ClamorServer.get_level_state(_number) as State


## What the bake holds, once it is open: [code]sources[/code] (their number), and the names of its
## [code]emitters[/code], [code]portals[/code] and movable [code]parts[/code].
func get_info() -> Dictionary:
	return ClamorServer.get_level_info(_number)


## Opens the bake's file again, as after it was baked anew. What plays goes on.
func reopen() -> void:
	if not is_inside_tree() or Engine.is_editor_hint():
		return
	var previous := _number
	_number = 0
	_is_open = false
	if bake != null and bake.resource_path != "":
		_baked_s = FileAccess.get_modified_time(bake.resource_path)
		var file := FileAccess.open(bake.resource_path, FileAccess.READ)
		if file == null:
			push_error("%s: %s cannot be opened: %s" % [get_path(), bake.resource_path, error_string(FileAccess.get_open_error())])
		else:
			_number = ClamorServer.open_level(file, bake.resource_path, str(get_path()))
	ClamorServer.close_level(previous)


func _enter_tree() -> void:
	if Engine.is_editor_hint():
		return
	_levels.append(self)
	reopen()
	_place()


func _exit_tree() -> void:
	if Engine.is_editor_hint():
		return
	_levels.erase(self)
	ClamorServer.close_level(_number)
	_number = 0


func _process(_delta: float) -> void:
	_place()
	if not _is_open and _number != 0 and get_state() == State.OPEN:
		_is_open = true
		opened.emit()
	if _is_open and OS.has_feature("editor") and Time.get_ticks_msec() > _looked_ms + 1000:
		_looked_ms = Time.get_ticks_msec()
		if FileAccess.get_modified_time(bake.resource_path) != _baked_s:
			reopen()


# Sources lie relative to the level that is heard.
func _place() -> void:
	if get_current() == self:
		ClamorServer.set_origin(global_transform.orthonormalized().affine_inverse())


func _get_configuration_warnings() -> PackedStringArray:
	if bake == null:
		return ["There is no bake yet. Press Bake in the toolbar above the 3D view, or set the property Bake."]
	if bake.resource_path == "" or bake.resource_path.contains("::"):
		return ["The bake must be a file of its own, a .clamor file."]
	return []
