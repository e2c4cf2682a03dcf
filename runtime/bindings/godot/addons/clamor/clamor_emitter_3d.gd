## A sound that is baked into a level with all its reflections: it costs no more however much it reverberates.
##
## The Bake button makes an emitter of the bake of each such node: where it is, with its [member stream].
## In the game, the node turns the emitter down or gives it another pitch, and silences it while the tree is paused and
## [member Node.process_mode] says so; what is baked can be neither moved nor made louder. Sounds that move or begin when
## the game says so are for [ClamorSource3D].
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

## Speed and pitch of the sound in the game, relative to the bake's. Other than at 1, the emitter is heard as a
## [ClamorSource3D] at its place would be, from the beginning of its [member stream] on, and with the reflections of
## the bake's probes.
@export_range(0.01, 4, 0.01, "or_greater") var pitch_scale := 1.0:
	set(value):
		pitch_scale = value
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
@export_range(0, 20, 0.1, "or_greater") var directivity := 0.0:
	set(value):
		directivity = value
		update_gizmos()

var _is_applied := false
var _is_paused := false
var _level_number := 0
var _state := []  # what ClamorServer knows of the bake's emitter
var _source := 0  # the number in ClamorServer of what is heard at another pitch; 0: the bake is heard


## The emitter's name in the bake.
func get_emitter_name() -> String:
	return str(name) if emitter == "" else emitter


func _process(_delta: float) -> void:
	_apply()


# Nothing is processed while the tree is paused.
func _notification(what: int) -> void:
	if what == NOTIFICATION_PAUSED or what == NOTIFICATION_UNPAUSED:
		_is_paused = what == NOTIFICATION_PAUSED
		_is_applied = false
		_apply()


func _apply() -> void:
	var level: ClamorLevel3D = null if Engine.is_editor_hint() else ClamorLevel3D._get_open()
	if level == null:
		return
	if _is_applied and level._number == _level_number:
		return
	_is_applied = true
	_level_number = level._number
	var gain := ClamorLevel3D._gain(volume_db)
	var is_retuned := pitch_scale != 1 and stream != null and not muted
	var state := [_level_number, get_emitter_name(), gain, muted or is_retuned or _is_paused]
	if state != _state and not ClamorServer.callv("set_emitter", state):
		push_warning("%s: %s has no emitter '%s'; it has %s." % [get_path(), level.bake.resource_path, get_emitter_name(), level.get_info().emitters])
		return
	_state = state
	if pitch_scale != 1 and stream == null:
		push_warning("%s: the emitter has no stream, so it keeps the pitch of the bake." % get_path())
	if not is_retuned:
		_end_source()
		return
	var options := {
		"gain": gain * ClamorLevel3D._gain(baked_volume_db), "pitch": pitch_scale * baked_pitch_scale,
		"directivity": directivity, "reverberation": 1.0, "paused": _is_paused,
	}
	if _source == 0:
		_source = ClamorServer.play_source(self, _looping(stream), options, 0.0)
	else:
		ClamorServer.change_source(_source, options)


func _exit_tree() -> void:
	_end_source()
	_is_applied = false


# ClamorServer calls this when a stream has ended that cannot loop by itself.
func _on_ended(_number: int) -> void:
	_source = 0
	_is_applied = false


func _end_source() -> void:
	ClamorServer.stop_source(_source)
	_source = 0


# A copy of the stream that loops, as it does in the bake.
static func _looping(stream_once: AudioStream) -> AudioStream:
	var copy: AudioStream = stream_once.duplicate()
	if copy is AudioStreamWAV:
		copy.loop_mode = AudioStreamWAV.LOOP_FORWARD
		copy.loop_begin = 0
		copy.loop_end = roundi(copy.get_length() * copy.mix_rate)
	elif "loop" in copy:
		copy.set("loop", true)
		copy.set("loop_offset", 0.0)
	return copy


func _get_configuration_warnings() -> PackedStringArray:
	return ["The emitter has no stream, so the Bake button leaves it out."] if stream == null else []
