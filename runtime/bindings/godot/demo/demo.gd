# The violin room: E turns the screen before the violin, R switches the radio, and the text tells what it costs.
extends Node3D

const RATE := 22050

var _is_open := false


func _ready() -> void:
	$Radio/Music.stream = _melody()
	$Radio/Music.play()
	$Ball/Knock.stream = _knock()


func _process(delta: float) -> void:
	var angle := deg_to_rad(90 if _is_open else 0)
	$Screen.rotation.y = move_toward($Screen.rotation.y, angle, 2 * delta)
	var costs: Dictionary = $Ears.get_statistics()
	$Text.text = "WASD and mouse: walk    E: screen    R: radio    Esc: leave\n%d voices, %.1f %% of the audio thread, %.1f ms for each of 50 keyframes a second" % [
		costs.voices, 100 * costs.audio_load, costs.keyframe_ms]


func _unhandled_key_input(event: InputEvent) -> void:
	if not event.is_pressed() or event.is_echo():
		return
	match (event as InputEventKey).physical_keycode:
		KEY_E:
			_is_open = not _is_open
		KEY_R:
			$Radio/Music.stream_paused = not $Radio/Music.stream_paused
		KEY_ESCAPE:
			get_tree().quit()


# Eight notes that repeat.
func _melody() -> AudioStreamWAV:
	var samples: PackedFloat32Array = []
	for step: int in [0, 4, 7, 12, 7, 9, 5, 4]:
		var hertz := 220 * pow(2, step / 12.0)
		for i in RATE / 4:
			var seconds := float(i) / RATE
			samples.append(0.3 * sin(TAU * hertz * seconds) * exp(-6 * seconds))
	var stream := _stream(samples)
	stream.loop_mode = AudioStreamWAV.LOOP_FORWARD
	stream.loop_end = samples.size()
	return stream


func _knock() -> AudioStreamWAV:
	var samples: PackedFloat32Array = []
	for i in RATE / 4:
		var seconds := float(i) / RATE
		samples.append(0.8 * sin(TAU * 180 * seconds) * exp(-40 * seconds))
	return _stream(samples)


func _stream(samples: PackedFloat32Array) -> AudioStreamWAV:
	var bytes := PackedByteArray()
	bytes.resize(2 * samples.size())
	for i in samples.size():
		bytes.encode_s16(2 * i, roundi(32767 * samples[i]))
	var stream := AudioStreamWAV.new()
	stream.format = AudioStreamWAV.FORMAT_16_BITS
	stream.mix_rate = RATE
	stream.data = bytes
	return stream
