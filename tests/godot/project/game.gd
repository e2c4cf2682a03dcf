# A game whose user arguments tell what it does: `MODE FILE`, a mode of _begin() and where to write what
# the listener hears in the first three seconds. It quits with a status of 0 if all went well.
extends Node3D

const SECONDS := 3.0
const BAKES := {
	"portal": "portal", "part": "portal", "broken": "broken", "retuned": "retuned", "changed": "retuned", "paused": "retuned",
}

var level := ClamorLevel3D.new()
var ears := ClamorListener3D.new()
var capture := AudioEffectCapture.new()
var heard: PackedVector2Array = []
var mode := "still"
var file := ""
var has_finished := false


func _ready() -> void:
	var arguments := OS.get_cmdline_user_args()
	if arguments.size() == 2:
		mode = arguments[0]
		file = arguments[1]
	AudioServer.add_bus()
	AudioServer.set_bus_name(1, "Ears")
	capture.buffer_length = 10
	AudioServer.add_bus_effect(1, capture)
	level.name = "Level"
	level.bake = load("res://%s.clamor" % BAKES.get(mode, "room"))
	add_child(level)
	ears.follow_camera = false
	ears.bus = "Ears"
	ears.limiter = false
	ears.position = Vector3(0, 1.75, 1)
	call("_begin_" + mode)
	while mode == "turned" and $Board/Door.get_faces().is_empty():  # CSG shapes have no mesh in their first frame
		await get_tree().process_frame
	add_child(ears)


func _process(_delta: float) -> void:
	heard.append_array(capture.get_buffer(capture.get_frames_available()))
	if heard.size() < SECONDS * AudioServer.get_mix_rate() * (3 if mode == "surround" else 1):
		return
	if file != "":
		var output := FileAccess.open(file, FileAccess.WRITE)
		output.store_buffer(heard.to_byte_array())
		output.close()
	set_process(false)
	call("_end_" + mode) if has_method("_end_" + mode) else get_tree().quit()


func _begin_still() -> void:
	pass


# A bake that is no bake, and one that lacks an emitter: both are told of with the nodes that want them.
func _begin_broken() -> void:
	while level.get_state() == ClamorLevel3D.State.OPENING:
		await get_tree().process_frame
	assert(level.get_state() == ClamorLevel3D.State.FAILED)
	level.bake = load("res://room.clamor")
	var emitter := ClamorEmitter3D.new()
	emitter.name = "viola"
	add_child(emitter)


func _end_broken() -> void:
	while level.get_state() != ClamorLevel3D.State.OPEN:
		await get_tree().process_frame
	await get_tree().process_frame
	await get_tree().process_frame
	get_tree().quit()


# Two listeners, each with its viewport's camera, as a split screen has them, hear the violin from where they are. The
# loudest source that either shows is its direct sound.
func _begin_split() -> void:
	for i in 2:
		var view := SubViewport.new()
		var camera := Camera3D.new()
		var listener := ClamorListener3D.new()
		view.name = "View%d" % i
		camera.position = Vector3(-1 + 2 * i, 1.75, 1)
		camera.rotation.y = PI * i
		listener.shown_sources = 10
		listener.name = "Listener"
		view.add_child(camera)
		view.add_child(listener)
		add_child(view)
	$View0/Listener.bus = "Ears"


func _end_split() -> void:
	var is_right: bool = Performance.get_custom_monitor("Clamor/late_blocks") >= 0
	for monitor: String in ["voices", "keyframe_ms", "audio_load", "memory_bytes"]:
		is_right = is_right and Performance.get_custom_monitor("Clamor/" + monitor) > 0
	for i in 2:
		var listener: ClamorListener3D = get_node("View%d/Listener" % i)
		var loudest: Array = ClamorServer.get_loudest_sources(listener._number, 10)
		var camera: Camera3D = listener.get_viewport().get_camera_3d()
		var to := camera.global_transform.affine_inverse() * Vector3(1, 1.2, -3)
		is_right = is_right and loudest.size() == 10 and loudest[0].normalized().dot(to.normalized()) > 0.999 \
			and listener._spheres.multimesh.instance_count == 10
	get_tree().quit(0 if is_right else 1)


# Six loudspeakers, which have the pairs of a block one after another in the capture.
func _begin_surround() -> void:
	ears.output = ClamorListener3D.Output.LOUDSPEAKERS
	assert(AudioServer.get_speaker_mode() == AudioServer.SPEAKER_SURROUND_51)


# A level that is baked while the game runs is heard as it is then.
func _begin_rebaked() -> void:
	DirAccess.copy_absolute("res://room.clamor", "res://rebaked.clamor")
	level.bake = load("res://rebaked.clamor")


func _end_rebaked() -> void:
	DirAccess.copy_absolute("res://portal.clamor", "res://rebaked.tmp")
	DirAccess.rename_absolute("res://rebaked.tmp", "res://rebaked.clamor")
	await level.opened
	DirAccess.remove_absolute("res://rebaked.clamor")
	get_tree().quit(0 if level.get_info().portals == ["Opening"] else 1)


# The level of one scene leaves before that of the next one enters. A listener who outlives both hears no gap.
func _begin_changed() -> void:
	await get_tree().create_timer(1).timeout
	var next := level.duplicate()
	level.queue_free()
	await get_tree().create_timer(0).timeout  # this and the last one are behind _process() of all nodes
	add_child(next)


func _end_changed() -> void:
	var powers := _powers()
	var mean: float = powers.reduce(func(sum: float, power: float) -> float: return sum + power) / powers.size()
	print("The softest 10 ms have %.3f of the mean power." % (powers.min() / mean))
	get_tree().quit(0 if powers.min() > 0.01 * mean else 1)


# An emitter falls silent with a tree that is paused, and sounds again.
func _begin_paused() -> void:
	process_mode = PROCESS_MODE_ALWAYS
	_begin_emitter()
	get_child(-1).process_mode = PROCESS_MODE_PAUSABLE
	for is_paused: bool in [true, false]:
		await get_tree().create_timer(1).timeout
		get_tree().paused = is_paused


func _end_paused() -> void:
	var powers := _powers()
	var silent := powers.filter(func(power: float) -> bool: return power < 1e-9).size()
	print("%d of %d times 10 ms are silent." % [silent, powers.size()])
	get_tree().quit(0 if silent > 50 and silent < 110 and powers[-1] > 1e-9 else 1)


# Of each 10 ms that are heard, from 0.2 s after the first sound on.
func _powers() -> Array[float]:
	var frames := int(AudioServer.get_mix_rate() / 100)
	var powers: Array[float] = []
	var begin := 0
	while heard[begin].length() < 1e-4:
		begin += 1
	for i in range(begin + 20 * frames, heard.size() - frames, frames):
		powers.append(0.0)
		for frame in heard.slice(i, i + frames):
			powers[-1] += frame.length_squared() / frames
	return powers


# A level that lies elsewhere sounds the same to a listener who has moved with it.
func _begin_moved() -> void:
	level.transform = Transform3D(Basis(Vector3.UP, PI / 2), Vector3(64, 0, -32))
	ears.transform = level.transform * ears.transform


# An emitter at half its amplitude.
func _begin_emitter() -> void:
	var violin := ClamorEmitter3D.new()
	violin.name = "violin"
	violin.volume_db = linear_to_db(0.5)
	add_child(violin)


# A door that is half open opens its portal by half.
func _begin_portal() -> void:
	var door := Node3D.new()
	var portal := ClamorPortal3D.new()
	portal.portal = "Opening"
	portal.mode = ClamorPortal3D.Mode.ANGLE
	portal.door = door
	add_child(door)
	add_child(portal)
	door.rotation_degrees.y = 45
	assert(absf(portal.get_openness() - 0.5) < 1e-6)


# A board before the violin: a mesh, and, where it is turned, a CSG shape.
func _begin_door(board: Node3D = MeshInstance3D.new()) -> void:
	var box := BoxMesh.new()
	box.size = Vector3(1, 2, 0.0625)
	board.set("mesh", box)
	board.set("size", box.size)
	var door := ClamorDoor3D.new()
	door.name = "Door"
	board.add_child(door)
	add_child(board)
	board.name = "Board"
	board.position = Vector3(0.5, 1.25, -1)
	var faces := FileAccess.open(file + ".faces", FileAccess.WRITE)
	faces.store_buffer(box.get_faces().to_byte_array())


# A lectern that is a movable part of the bake stands before the violin, as its node does.
func _begin_part() -> void:
	var lectern := Node3D.new()
	lectern.name = "lectern"
	lectern.position = Vector3(0.5, 0.75, -1)
	lectern.add_child(ClamorDoor3D.new())
	add_child(lectern)


func _begin_turned() -> void:
	_begin_door(CSGBox3D.new())
	$Board.rotation_degrees.y = 45


# A sound of the game's. The violin is silent.
func _begin_source(stream: AudioStream = _ramp(0.5)) -> void:
	_begin_emitter()
	get_child(-1).muted = true
	var source := ClamorSource3D.new()
	source.name = "Source"
	source.stream = stream
	source.position = Vector3(-1, 1.5, 0)
	source.volume_db = linear_to_db(0.5)
	source.directivity = 1
	source.finished.connect(func() -> void: has_finished = true)
	source.autoplay = true
	add_child(source)


func _end_source() -> void:
	var source: ClamorSource3D = $Source
	if not has_finished:
		await source.finished
	get_tree().quit(1 if source.is_playing() else 0)


# As above, of a stream that is decoded while it plays, since it may be another one each time.
func _begin_streamed() -> void:
	var stream := AudioStreamRandomizer.new()
	stream.add_stream(-1, _ramp(0.5))
	_begin_source(stream)


func _end_streamed() -> void:
	_end_source()


# A tone that comes nearer at 5 m/s for 0.6 s, and goes away again.
func _begin_doppler() -> void:
	_begin_tone()
	_fly($Source)


# The same, but it is the listener that moves.
func _begin_doppler_ears() -> void:
	_begin_tone()
	$Source.position = ears.position
	_fly(ears)


func _begin_tone() -> void:
	ears.output = ClamorListener3D.Output.RECEIVERS
	_begin_source(_looping("res://tone.wav"))
	$Source.directivity = 0
	$Source.reverberation_db = -80


func _fly(node: Node3D) -> void:
	node.position = Vector3(-3.5, 1.75, 1)
	var flight := create_tween()
	flight.tween_property(node, "position:x", -0.5, 0.6)
	flight.tween_property(node, "position:x", -3.5, 0.6)


# The bake's emitter, whose pitch becomes one and a half times as high after a second, and which falls silent after two.
func _begin_retuned() -> void:
	var emitter := ClamorEmitter3D.new()
	emitter.name = "violin"
	emitter.stream = AudioStreamWAV.load_from_file("res://retuned.wav")
	emitter.position = Vector3(1, 1.2, -3)
	add_child(emitter)
	var score := create_tween()
	score.tween_property(emitter, "pitch_scale", 1.5, 0).set_delay(1)
	score.tween_property(emitter, "muted", true, 0).set_delay(1)


func _looping(path: String) -> AudioStreamWAV:
	var stream := AudioStreamWAV.load_from_file(path)
	stream.loop_mode = AudioStreamWAV.LOOP_FORWARD
	stream.loop_end = roundi(stream.get_length() * stream.mix_rate)
	return stream


# Four sounds are asked for of a source that plays two at a time, and others are sought, stopped and paused.
func _begin_polyphony() -> void:
	_begin_source()
	var source: ClamorSource3D = $Source
	source.max_polyphony = 2
	await get_tree().process_frame
	for i in 4:
		source.play()
	assert(source._playing.size() == 2)
	source.seek(0.25)
	assert(source._playing.size() == 1 and source.get_playback_position() >= 0.25)
	source.stop()
	assert(not source.is_playing())
	source.play()
	get_tree().paused = true
	await get_tree().create_timer(1).timeout
	assert(source.get_playback_position() < 0.25)
	get_tree().paused = false
	# A sound that gets another pitch goes on where it is, and one that loops never ends.
	source.stream = _ramp(0.2)
	source.stream.loop_mode = AudioStreamWAV.LOOP_FORWARD
	source.stream.loop_end = int(0.2 * source.stream.mix_rate)
	source.play(0.1)
	source.seek(0.05)
	await get_tree().create_timer(0.5).timeout
	assert(source.is_playing() and source.get_playback_position() < 0.2)
	source.stop()
	source.stream = _ramp(2)
	source.play(0.5)
	source.pitch_scale = 2
	assert(source.get_playback_position() >= 0.5)
	await source.finished
	get_tree().quit(1 if source.is_playing() else 0)


# It quits by itself.
func _end_polyphony() -> void:
	pass


# Noise that is the same everywhere, `seconds` long.
func _ramp(seconds: float) -> AudioStreamWAV:
	var stream := AudioStreamWAV.new()
	stream.format = AudioStreamWAV.FORMAT_16_BITS
	stream.mix_rate = int(AudioServer.get_mix_rate())
	var bytes := PackedByteArray()
	bytes.resize(2 * int(seconds * stream.mix_rate))
	for i in bytes.size() / 2:
		bytes.encode_s16(2 * i, (i * 7919) % 16384 - 8192)
	stream.data = bytes
	return stream


# Two scenes by turns, each with a level, a listener and a source. Of 100 scenes, what remained of a source alone would
# be 50 MiB.
func _begin_scenes() -> void:
	level.queue_free()


func _end_scenes() -> void:
	var at_first := 0
	for i in 120:
		var scene := Node3D.new()
		var room := ClamorLevel3D.new()
		var listener := ClamorListener3D.new()
		var source := ClamorSource3D.new()
		room.bake = load("res://room.clamor" if i % 2 == 0 else "res://portal.clamor")
		source.stream = _ramp(0.1)
		source.autoplay = true
		scene.add_child(room)
		scene.add_child(listener)
		scene.add_child(source)
		get_tree().root.add_child(scene)
		while listener.get_statistics().voices == 0:
			await get_tree().process_frame
		scene.free()
		if i == 19:
			at_first = _memory_kib()
	var grown := _memory_kib() - at_first
	print("100 scenes: %d KiB more than %d" % [grown, at_first])
	get_tree().quit(0 if at_first > 0 and grown < 32768 else 1)


func _memory_kib() -> int:
	var status := FileAccess.open("/proc/self/status", FileAccess.READ)
	for i in 60:
		var line := status.get_line()
		if line.begins_with("VmRSS:"):
			return line.trim_prefix("VmRSS:").strip_edges().to_int()
	return 0
