## A rectangle in an opening, as in a doorway: as it closes, reflections that came through it fade.
##
## The Bake button makes a portal of each such node. A door that closes also hides what is behind it: that is
## [ClamorDoor3D].
@tool
@icon("icons/portal.svg")
class_name ClamorPortal3D
extends Node3D

## What opens the portal.
enum Mode {
	PARTS = 0,  ## The movable parts in it, as [ClamorDoor3D] nodes move them.
	ANGLE = 1,  ## The angle by which [member door] has turned since it entered the tree.
	VALUE = 2,  ## [member openness].
}

## The portal's name in the bake. Empty: the name of this node.
@export var portal := ""

## Width and height of the opening, along X and Y of this node.
@export var size := Vector2(0.9, 2.0):
	set(value):
		size = value
		update_gizmos()

## What opens the portal.
@export var mode := Mode.PARTS:
	set(value):
		mode = value
		update_configuration_warnings()

## The node whose angle opens the portal, with [constant ANGLE]. It must be closed when it enters the tree.
@export var door: Node3D:
	set(value):
		door = value
		update_configuration_warnings()

## The angle at which the portal is open entirely, with [constant ANGLE].
@export_range(1, 180, 0.1, "degrees") var open_angle := 90.0

## Share of the power that passes, with [constant VALUE]: 0 is closed, 1 is open.
@export_range(0, 1, 0.01) var openness := 1.0

var _closed := Quaternion.IDENTITY
var _applied := NAN
var _level_number := 0


## The portal's name in the bake.
func get_portal_name() -> String:
	return str(name) if portal == "" else portal


## How open the portal is, 0 to 1, or -1 where parts open and close it.
func get_openness() -> float:
	match mode:
		Mode.ANGLE when door != null:
			return clampf(rad_to_deg(_closed.angle_to(door.quaternion)) / open_angle, 0, 1)
		Mode.VALUE:
			return clampf(openness, 0, 1)
	return -1


func _ready() -> void:
	if door != null:
		_closed = door.quaternion


func _process(_delta: float) -> void:
	if Engine.is_editor_hint():
		return
	var level := ClamorLevel3D._get_open()
	if level == null:
		return
	var wanted := get_openness()
	if wanted == _applied and level._number == _level_number:
		return
	_applied = wanted
	_level_number = level._number
	if not ClamorServer.set_portal(level._number, get_portal_name(), wanted):
		push_warning("%s: %s has no portal '%s'; it has %s." % [get_path(), level.bake.resource_path, get_portal_name(), level.get_info().portals])


func _get_configuration_warnings() -> PackedStringArray:
	if mode == Mode.ANGLE and door == null:
		return ["Set the property Door, whose angle opens the portal."]
	return []
