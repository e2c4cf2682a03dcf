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
@export var autoplay := false:
	set(value):
		autoplay = value
		update_configuration_warnings()

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
		update_gizmos()
		_change()

## Gain of its reflections, relative to what the place has. -80 dB: direct sound alone.
@export_range(-80, 24, 0.1, "suffix:dB") var reverberation_db := 0.0:
	set(value):
		reverberation_db = value
		_change()

# Numbers of ClamorServer's, the oldest first.
var _playing: Array[int] = []
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
		ClamorServer.stop_source(_playing.pop_front())
	var number: int = ClamorServer.play_source(self, stream, _options(), from_position)
	if number != 0:
		_playing.append(number)


## Ends all sounds. What they have sounded dies away.
func stop() -> void:
	for number in _playing:
		ClamorServer.stop_source(number)
	_playing.clear()


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
	return 0.0 if _playing.is_empty() else ClamorServer.get_source_position(_playing[-1])


func _ready() -> void:
	if autoplay and not Engine.is_editor_hint():
		play()


func _exit_tree() -> void:
	stop()


func _notification(what: int) -> void:
	if what == NOTIFICATION_PAUSED or what == NOTIFICATION_UNPAUSED:
		_is_tree_paused = what == NOTIFICATION_PAUSED
		_change()


# ClamorServer calls this when a sound has ended by itself. It reads where the node is, too, once a frame.
func _on_ended(number: int) -> void:
	_playing.erase(number)
	finished.emit()


func _get_configuration_warnings() -> PackedStringArray:
	return ["The source has no stream to begin with."] if autoplay and stream == null else []


func _options() -> Dictionary:
	return {
		"gain": ClamorLevel3D._gain(volume_db),
		"pitch": pitch_scale,
		"directivity": directivity,
		"reverberation": ClamorLevel3D._gain(reverberation_db),
		"paused": stream_paused or _is_tree_paused,
	}


func _change() -> void:
	for number in _playing:
		ClamorServer.change_source(number, _options())
