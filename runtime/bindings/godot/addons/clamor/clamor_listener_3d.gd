## Hears the level: the ears of a player.
##
## What it hears goes to an audio bus. It hears nothing where no [ClamorLevel3D] is in the tree. Several
## listeners, as for a split screen, each have their own sound.
@tool
@icon("icons/listener.svg")
class_name ClamorListener3D
extends Node3D

## Kinds of output.
enum Output {
	BINAURAL = 0,  ## For headphones, with a head that turns.
	LOUDSPEAKERS = 1,  ## For the loudspeakers that Godot plays to: two, or those of 5.1 or 7.1.
	RECEIVERS = 3,  ## Two omnidirectional microphones, a head's width apart.
}

## Whether the listener is where the viewport's current [Camera3D] is, instead of where this node is.
@export var follow_camera := true

## What the sound is made for.
@export var output := Output.BINAURAL:
	set(value):
		output = value
		_restart()

## A head of your own for binaural output, a SOFA file outside of archives. Empty: the head that Clamor brings.
@export_file("*.sofa") var sofa := "":
	set(value):
		sofa = value
		_restart()

## How many sources are mixed at a time. More of them sound smoother and cost more CPU time.
@export_range(1, 20000, 1, "exp") var voices := 2000:
	set(value):
		voices = value
		_restart()

## Gain of the output.
@export_range(-80, 24, 0.1, "suffix:dB") var volume_db := 0.0:
	set(value):
		volume_db = value
		if _own_bus != &"":
			AudioServer.set_bus_volume_db(AudioServer.get_bus_index(_own_bus), value)
		elif _player != null:
			_player.volume_db = value

## Whether true peaks stay below -1 dBFS.
@export var limiter := true:
	set(value):
		limiter = value
		_restart()

## The bus that the sound goes to.
@export var bus := &"Master":
	set(value):
		bus = value
		if _own_bus != &"":
			AudioServer.set_bus_send(AudioServer.get_bus_index(_own_bus), value)
		elif _player != null:
			_player.bus = value

## How many of the loudest sources are shown in the game, while it is developed: as spheres around the listener,
## 2 m away, in the direction from which their sound comes. The radius of the loudest is 0.1 m, and falls to nothing at
## -60 dB. Above 0, a level of thousands of sources is mixed at a higher cost.
@export_range(0, 256) var shown_sources := 0:
	set(value):
		shown_sources = value
		_restart()

const _LAYOUTS := {AudioServer.SPEAKER_SURROUND_51: "5.1", AudioServer.SPEAKER_SURROUND_71: "7.1"}

# The listener's number in ClamorServer, and that of the level that it is in.
var _number := 0
var _level_number := 0
var _frames_without_level := 0  # one or two, while a scene takes another one's place
var _player: AudioStreamPlayer
var _own_bus := &""  # where Godot plays to more than two loudspeakers
var _speakers := AudioServer.SPEAKER_MODE_STEREO
var _spheres: MultiMeshInstance3D


## What the listener costs: [code]voices[/code] that are mixed, [code]keyframe_ms[/code] (CPU time of a
## choice of voices, 50 a second), [code]audio_load[/code] (share of the audio thread's time),
## [code]late_blocks[/code] and [code]memory_bytes[/code].
func get_statistics() -> Dictionary:
	return ClamorServer.get_listener_statistics(_number)


func _enter_tree() -> void:
	if Engine.is_editor_hint():
		return
	for value: String in ["voices", "keyframe_ms", "audio_load", "late_blocks", "memory_bytes"]:
		var monitor := "Clamor/" + value
		if not Performance.has_custom_monitor(monitor):
			Performance.add_custom_monitor(monitor, _monitor, [value])
			_monitors.append(monitor)


func _exit_tree() -> void:
	_stop()
	for monitor in _monitors:
		Performance.remove_custom_monitor(monitor)
	_monitors.clear()


func _process(_delta: float) -> void:
	if Engine.is_editor_hint():
		return
	var level := ClamorLevel3D.get_current()
	_frames_without_level = 0 if level != null else _frames_without_level + 1
	if _frames_without_level > 2 or _speakers != AudioServer.get_speaker_mode():
		_stop()
	if level == null:
		return
	var camera := get_viewport().get_camera_3d() if follow_camera else null
	var heard_at := global_transform if camera == null else camera.global_transform
	var place := ClamorLevel3D.to_level(heard_at)
	var turned := place.basis.get_rotation_quaternion()
	if _number == 0:
		_start(level, place.origin, turned)
	elif _level_number != level._number:
		ClamorServer.enter_level(_number, level._number)
		_level_number = level._number
	ClamorServer.move_listener(_number, place.origin, turned)
	if shown_sources > 0:
		_show_sources(heard_at.orthonormalized())


func _validate_property(property: Dictionary) -> void:
	if property.name == "bus":
		var names: PackedStringArray = []
		for i in AudioServer.bus_count:
			names.append(AudioServer.get_bus_name(i))
		property.hint = PROPERTY_HINT_ENUM
		property.hint_string = ",".join(names)


func _get_configuration_warnings() -> PackedStringArray:
	return ["A scaled listener has no meaning to Clamor."] if not scale.is_equal_approx(Vector3.ONE) else []


var _monitors: Array[String] = []


func _monitor(value: String) -> float:
	return get_statistics()[value]


func _start(level: ClamorLevel3D, position_m: Vector3, turned: Quaternion) -> void:
	var options := {
		"output": output, "sofa": ProjectSettings.globalize_path(sofa), "voices": voices, "limiter": limiter,
		"gain": 1.0, "layout": "stereo", "reports_voices": shown_sources > 0, "position": position_m, "rotation": turned,
	}
	_speakers = AudioServer.get_speaker_mode()
	if output == Output.LOUDSPEAKERS and _speakers in _LAYOUTS:
		options.layout = _LAYOUTS[_speakers]
	_level_number = level._number
	_number = ClamorServer.create_listener(_level_number, options, str(get_path()))
	_player = AudioStreamPlayer.new()
	_player.stream = ClamorServer.get_listener_stream(_number)
	_player.bus = bus
	_player.volume_db = volume_db
	_player.process_mode = Node.PROCESS_MODE_ALWAYS
	if options.layout != "stereo":
		_begin_own_bus()
	add_child(_player, false, Node.INTERNAL_MODE_BACK)
	_player.play()


# Streams of Godot's have two channels. An effect puts the others on a bus that nothing else plays to.
func _begin_own_bus() -> void:
	_own_bus = StringName("ClamorListener%d" % _number)
	var index := AudioServer.bus_count
	AudioServer.add_bus()
	AudioServer.set_bus_name(index, _own_bus)
	AudioServer.set_bus_send(index, bus)
	AudioServer.set_bus_volume_db(index, volume_db)
	AudioServer.add_bus_effect(index, ClamorServer.get_listener_effect(_number))
	_player.bus = _own_bus
	_player.mix_target = AudioStreamPlayer.MIX_TARGET_SURROUND


func _stop() -> void:
	ClamorServer.free_listener(_number)
	_number = 0
	if _player != null:
		_player.queue_free()
		_player = null
	if _own_bus != &"":
		AudioServer.remove_bus(AudioServer.get_bus_index(_own_bus))
		_own_bus = &""
	if _spheres != null:
		_spheres.queue_free()
		_spheres = null


func _restart() -> void:
	if _number != 0:
		_stop()


func _show_sources(place: Transform3D) -> void:
	if _spheres == null:
		var material := StandardMaterial3D.new()
		material.shading_mode = BaseMaterial3D.SHADING_MODE_UNSHADED
		material.no_depth_test = true
		material.albedo_color = Color("fc7f7f")
		var sphere := SphereMesh.new()
		sphere.radius = 0.1
		sphere.height = 0.2
		sphere.material = material
		_spheres = MultiMeshInstance3D.new()
		_spheres.multimesh = MultiMesh.new()
		_spheres.multimesh.transform_format = MultiMesh.TRANSFORM_3D
		_spheres.multimesh.mesh = sphere
		_spheres.top_level = true
		add_child(_spheres, false, Node.INTERNAL_MODE_BACK)
	_spheres.global_transform = place
	var sources: Array = ClamorServer.get_loudest_sources(_number, shown_sources)
	_spheres.multimesh.instance_count = sources.size()
	for i in sources.size():
		var size := maxf(1 + linear_to_db(sources[i].length() / sources[0].length()) / 60, 0.01)
		_spheres.multimesh.set_instance_transform(i, Transform3D(Basis.from_scale(size * Vector3.ONE), 2 * sources[i].normalized()))
