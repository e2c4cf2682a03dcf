## Plays an [AudioStream] in the level, as [AudioStreamPlayer3D] does without one.
##
## What it plays is occluded and reflected by doors and walls, and reverberates as the place does where it
## is, if the bake has probes. It may move: Doppler shifts follow.
@tool
@icon("icons/source.svg")
class_name ClamorSource3D
extends Node3D

## A sound has ended by itself. It is not emitted by [method stop], and not by sounds that loop.
signal finished

## The sound, any [AudioStream] of Godot's. Its channels are mixed to one.
@export var stream: AudioStream:
	set(value):
		stream = value
		update_configuration_warnings()

## Gain: at 0 dB, full scale is full scale at 1 m.
@export_range(-80, 48, 0.1, "suffix:dB") var volume_db := 0.0:
	set(value):
		volume_db = value
		_change()

## Speed and pitch of the sound.
@export_range(0.01, 4, 0.01, "or_greater") var pitch_scale := 1.0:
	set(value):
		pitch_scale = value
		_change()

## Whether the sound begins when the node enters the tree.
@export var autoplay := false

## Whether sounds stand still. They also do while the tree is paused and [member Node.process_mode] says so.
@export var stream_paused := false:
	set(value):
		stream_paused = value
		_change()

## How many sounds play at a time, if [method play] is called again. One more ends the oldest.
@export_range(1, 64) var max_polyphony := 1

## How much it favours the direction in which the node looks (-Z): 0 is omnidirectional, 1 a cardioid.
@export_range(0, 20, 0.1, "or_greater") var directivity := 0.0:
	set(value):
		directivity = value
		_change()

## Gain of its reflections, relative to what the place has. -80 dB: direct sound alone.
@export_range(-80, 24, 0.1, "suffix:dB") var reverberation_db := 0.0:
	set(value):
		reverberation_db = value
		_change()

# Numbers of ClamorServer's, the oldest first, each with the AudioStreamPlayback that it plays.
var _playing: Dictionary[int, AudioStreamPlayback] = {}
var _place := Transform3D()
var _is_tree_paused := false


## Plays the sound from a position [s] on.
func play(from_position := 0.0) -> void:
	if not is_inside_tree():
		push_error("%s: a source must be in the tree to play." % name)
		return
	if stream == null:
		push_error("%s: the source has no stream." % get_path())
		return
	while _playing.size() >= max_polyphony:
		_end(_playing.keys()[0])
	var playback := stream.instantiate_playback()
	playback.start(from_position)
	_place = ClamorLevel3D.to_level(global_transform)
	var number := ClamorServer.play_source(playback, _options(), _place.origin)
	if number != 0:
		_playing[number] = playback


## Ends all sounds. What they have sounded dies away.
func stop() -> void:
	for number: int in _playing.keys():
		_end(number)


## Plays from another position [s] on.
func seek(to_position: float) -> void:
	if is_playing():
		stop()
		play(to_position)


## Whether a sound plays.
func is_playing() -> bool:
	return not _playing.is_empty()


## The position [s] in the newest sound.
func get_playback_position() -> float:
	return 0.0 if _playing.is_empty() else _playing.values()[-1].get_playback_position()


func _ready() -> void:
	if autoplay and not Engine.is_editor_hint():
		play()


func _exit_tree() -> void:
	stop()


func _notification(what: int) -> void:
	if what == NOTIFICATION_PAUSED or what == NOTIFICATION_UNPAUSED:
		_is_tree_paused = what == NOTIFICATION_PAUSED
		_change()


func _process(_delta: float) -> void:
	if _playing.is_empty():
		return
	var place := ClamorLevel3D.to_level(global_transform)
	var has_moved := place != _place
	_place = place
	for number: int in _playing.keys():
		if not ClamorServer.is_source_playing(number):
			_playing.erase(number)
			finished.emit()
		elif has_moved:
			ClamorServer.move_source(number, place.origin, -place.basis.z)


func _get_configuration_warnings() -> PackedStringArray:
	return ["The source has no stream."] if stream == null else []


func _options() -> Dictionary:
	return {
		"gain": ClamorLevel3D._gain(volume_db),
		"pitch": pitch_scale,
		"directivity": directivity,
		"reverberation": ClamorLevel3D._gain(reverberation_db),
		"paused": stream_paused or _is_tree_paused,
		"axis": -_place.basis.z,
	}


func _change() -> void:
	for number: int in _playing:
		ClamorServer.change_source(number, _options())


func _end(number: int) -> void:
	ClamorServer.stop_source(number)
	_playing.erase(number)
