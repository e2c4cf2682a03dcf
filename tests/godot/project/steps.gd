# Does the steps of the add-on's page from an empty project on, as they stand there, and listens to the result.
# The page lies at res://README.md. Words that it understands are those of _do().
extends SceneTree

const Baker := preload("res://addons/clamor/editor/baker.gd")

var baker := Baker.new()
var scene: Node3D
var steps: PackedStringArray = []
var capture := AudioEffectCapture.new()
var loudest := 0.0
var frame := 0


func _initialize() -> void:
	var numbered := RegEx.create_from_string("(?m)^\\d+\\. (.*)$")
	for step in numbered.search_all(FileAccess.get_file_as_string("res://README.md")):
		steps.append(step.get_string(1))


func _process(_delta: float) -> bool:
	frame += 1
	if baker.is_baking():
		baker.poll()
	elif not steps.is_empty():
		var step := steps[0]
		steps.remove_at(0)
		print(step)
		_do(step)
	elif scene != null and scene.process_mode == Node.PROCESS_MODE_DISABLED:
		_play()
	else:
		for sample in capture.get_buffer(capture.get_frames_available()):
			loudest = maxf(loudest, sample.length())
		if loudest > 1e-3 or frame > 2000:
			print("The loudest sample is %.3f." % loudest)
			quit(0 if loudest > 1e-3 else 1)
	return false


func _do(step: String) -> void:
	var added := _first("Add an? `(\\w+)`", step)
	if step.contains("Make a 3D scene"):
		scene = Node3D.new()
		scene.name = "Room"
		scene.process_mode = Node.PROCESS_MODE_DISABLED  # as in the editor, until F6
		scene.scene_file_path = "res://" + _first("save it as `([\\w.]+)`", step)
		get_root().add_child(scene)
	elif added != "":
		_add(added, step)
	elif step.begins_with("Press **Bake**"):
		baker.baked.connect(func(level: ClamorLevel3D, bake: ClamorBake) -> void: level.bake = bake)
		baker.bake(scene, "Draft")
		assert(baker.is_baking())
	elif step.begins_with("Save, and press F6"):
		print(baker.findings)
		var packed := PackedScene.new()
		packed.pack(scene)
		ResourceSaver.save(packed, scene.scene_file_path)
	else:  # the add-on and the sound are there already
		assert(step.begins_with("Unpack") or step.begins_with("Copy a WAV"))


func _add(type: String, step: String) -> void:
	var script := ""
	for known: Dictionary in ProjectSettings.get_global_class_list():
		if known["class"] == type:
			script = known.path
	var node: Node3D = load(script).new() if script != "" else ClassDB.instantiate(type)
	var title := _first("name it `(\\w+)`", step)
	node.name = title if title != "" else type
	var size := _first("of ([\\d.]+ x [\\d.]+ x [\\d.]+) m", step).split_floats(" x ")
	if size.size() == 3:
		node.set("size", Vector3(size[0], size[1], size[2]))
	var place := _first("at \\(([^)]+)\\)", step).split_floats(", ")
	if place.size() == 3:
		node.position = Vector3(place[0], place[1], place[2])
	var stream := _first("\\*Stream\\* to `([\\w.]+)`", step)
	if stream != "":
		node.set("stream", load("res://" + stream))
	for wanted in RegEx.create_from_string("[Ss]et \\*([\\w ]+)\\*").search_all(step):
		node.set(wanted.get_string(1).to_snake_case(), true)
	scene.add_child(node)
	node.owner = scene


func _play() -> void:
	var path := scene.scene_file_path
	scene.free()
	AudioServer.add_bus_effect(0, capture)
	scene = load(path).instantiate()
	scene.process_mode = Node.PROCESS_MODE_INHERIT
	frame = 0
	get_root().add_child(scene)


# What the first group of a pattern matches, or "".
func _first(pattern: String, text: String) -> String:
	var found := RegEx.create_from_string(pattern).search(text)
	return "" if found == null else found.get_string(1)
