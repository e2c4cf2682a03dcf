# A game whose 1000 nodes play a sound: `KIND MOTION`, of ClamorSource3D nodes ("clamor") or, for comparison, idle
# AudioStreamPlayer3D nodes ("godot"), which are "still" or "moving". It prints its CPU time for each second of the game.
extends SceneTree

const COUNT := 1000
const RATE := 48000  # of movies
const BEGIN_S := 3.0
const SECONDS := 10.0

var nodes: Array[Node3D] = []
var is_moving := OS.get_cmdline_user_args()[1] == "moving"
var begin_cpu_s := 0.0
var time_s := 0.0
var ears := ClamorListener3D.new()


func _initialize() -> void:
	var is_ours := OS.get_cmdline_user_args()[0] == "clamor"
	assert(AudioServer.get_mix_rate() == RATE)
	var bytes := PackedByteArray()
	bytes.resize(2 * RATE)
	for i in RATE:
		bytes.encode_s16(2 * i, (i * 7919) % 16384 - 8192)
	var sound := AudioStreamWAV.new()
	sound.format = AudioStreamWAV.FORMAT_16_BITS
	sound.data = bytes
	sound.mix_rate = RATE
	sound.loop_mode = AudioStreamWAV.LOOP_FORWARD
	sound.loop_end = RATE
	if is_ours:
		var level := ClamorLevel3D.new()
		level.bake = load("res://retuned.clamor")
		root.add_child(level)
		ears.follow_camera = false
		ears.position = Vector3(0, 1.75, 1)
		root.add_child(ears)
	for i in COUNT:
		var node: Node3D = ClamorSource3D.new() if is_ours else AudioStreamPlayer3D.new()
		node.set("stream", sound)
		node.set("autoplay", is_ours)
		node.set("volume_db", -50)
		node.position = _place(i)
		root.add_child(node)
		nodes.append(node)


func _process(delta: float) -> bool:
	time_s += delta
	if is_moving:
		for i in COUNT:
			nodes[i].position = _place(i)
	if begin_cpu_s == 0 and time_s > BEGIN_S:
		begin_cpu_s = _cpu_s()
	if time_s < BEGIN_S + SECONDS:
		return false
	print("CPU: %.4f" % ((_cpu_s() - begin_cpu_s) / SECONDS))
	return true


func _place(i: int) -> Vector3:
	return Vector3(i % 10 * 0.3 - 1.5, 0.5 + i / 100 * 0.2, i / 10 % 10 * 0.4 - 3 + (0.2 * sin(time_s) if is_moving else 0.0))


# Of the main thread, which does all but to wait for the screen.
func _cpu_s() -> float:
	var values := FileAccess.open("/proc/thread-self/stat", FileAccess.READ).get_line().get_slice(")", 1).split(" ", false)
	return (float(values[11]) + float(values[12])) / 100
