## A sound that is baked into a level with all its reflections: it costs no more however much it reverberates.
##
## The Bake button makes an emitter of the bake of each such node: where it is, with its [member stream].
## In the game, the node turns the emitter down; what is baked can be neither moved nor made louder, and keeps its
## pitch, [member baked_pitch_scale]. Sounds that move or begin when the game says so are for [ClamorSource3D].
@tool
@icon("icons/emitter.svg")
class_name ClamorEmitter3D
extends Node3D

## The emitter's name in the bake. Empty: the name of this node.
@export var emitter := "":
	set(value):
		emitter = value
		_is_applied = false

## Gain relative to the bake's.
@export_range(-80, 0, 0.1, "suffix:dB") var volume_db := 0.0:
	set(value):
		volume_db = value
		_is_applied = false

## Whether the emitter is silent.
@export var muted := false:
	set(value):
		muted = value
		_is_applied = false

@export_group("Bake")

## The sound, any [AudioStream] that has an end. It loops, and its channels are mixed to one.
@export var stream: AudioStream:
	set(value):
		stream = value
		update_configuration_warnings()

## Gain of the bake: at 0 dB, full scale is full scale at 1 m.
@export_range(-80, 48, 0.1, "suffix:dB") var baked_volume_db := 0.0

## Speed and pitch of the sound in the bake.
@export_range(0.01, 4, 0.01, "or_greater") var baked_pitch_scale := 1.0

## How much it favours the direction in which the node looks (-Z): 0 is omnidirectional, 1 a cardioid.
@export_range(0, 20, 0.1, "or_greater") var directivity := 0.0

var _is_applied := false
var _level_number := 0


## The emitter's name in the bake.
func get_emitter_name() -> String:
	return str(name) if emitter == "" else emitter


func _process(_delta: float) -> void:
	if Engine.is_editor_hint():
		return
	var level := ClamorLevel3D._get_open()
	if level == null:
		return
	if _is_applied and level._number == _level_number:
		return
	_is_applied = true
	_level_number = level._number
	var gain := ClamorLevel3D._gain(volume_db)
	if not ClamorServer.set_emitter(level._number, get_emitter_name(), gain, muted):
		push_warning("%s: %s has no emitter '%s'; it has %s." % [get_path(), level.bake.resource_path, get_emitter_name(), level.get_info().emitters])


func _get_configuration_warnings() -> PackedStringArray:
	return ["The emitter has no stream, so the Bake button leaves it out."] if stream == null else []
