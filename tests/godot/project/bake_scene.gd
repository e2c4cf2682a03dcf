# Bakes a scene with each kind of surface as the Bake button does, and looks at what the bake holds. With `-- sources`,
# the scene has neither an emitter with a sound nor a probe, and a source.
extends SceneTree

const Baker := preload("res://addons/clamor/editor/baker.gd")

var baker := Baker.new()
var scene := Node3D.new()
var result: ClamorBake
var frame := 0
var has_emitters := true


func _initialize() -> void:
	scene.name = "Scene"
	var level := _add(ClamorLevel3D.new(), "Level")
	level.probe_spacing = 2
	level.bake_layers = 3
	level.materials["Floor*"] = ClamorMaterial.new()
	level.materials["Floor*"].preset = "carpet"
	# The shell of a room, of which two walls are cells of a GridMap and of a MultiMesh, and the rest is CSG.
	var room := _add(CSGBox3D.new(), "Room brick")
	room.size = Vector3(8, 3, 6)
	room.flip_faces = true
	var cubes := MultiMesh.new()
	cubes.transform_format = MultiMesh.TRANSFORM_3D
	cubes.mesh = BoxMesh.new()
	cubes.mesh.resource_name = "wood"
	cubes.instance_count = 3
	cubes.buffer = [1, 0, 0, -1.5, 0, 1, 0, -1, 0, 0, 1, -2, 1, 0, 0, 0, 0, 1, 0, -1, 0, 0, 1, -2, 1, 0, 0, 1.5, 0, 1, 0, -1, 0, 0, 1, -2]
	_add(MultiMeshInstance3D.new(), "Crates").multimesh = cubes
	var library := MeshLibrary.new()
	library.create_item(0)
	library.set_item_mesh(0, BoxMesh.new())
	var grid := _add(GridMap.new(), "Grid")
	grid.mesh_library = library
	grid.set_cell_item(Vector3i(1, 0, 1), 0)
	var floor_mesh := PlaneMesh.new()
	floor_mesh.size = Vector2(7, 5)
	var carpet := _add(MeshInstance3D.new(), "Floor")
	carpet.mesh = floor_mesh
	carpet.position.y = -1.4
	carpet.layers = 6
	var other := _add(MeshInstance3D.new(), "Unbaked layer")
	other.mesh = BoxMesh.new()
	other.layers = 4
	var ball := _add(RigidBody3D.new(), "Ball")
	var moving := MeshInstance3D.new()
	moving.name = "Unbaked"
	moving.mesh = BoxMesh.new()
	ball.add_child(moving)
	moving.owner = scene
	var hidden := _add(MeshInstance3D.new(), "Unseen")
	hidden.mesh = BoxMesh.new()
	hidden.visible = false
	var leaf := _add(MeshInstance3D.new(), "Leaf")
	leaf.mesh = BoxMesh.new()
	leaf.position = Vector3(2, 0, 0)
	var door := ClamorDoor3D.new()
	leaf.add_child(door)
	door.owner = scene
	var portal := _add(ClamorPortal3D.new(), "Opening")
	portal.position = Vector3(1, 0, 0)
	portal.mode = ClamorPortal3D.Mode.VALUE
	var tone := AudioStreamWAV.load_from_file("res://tone.wav")
	tone.take_over_path("res://tone.wav")
	has_emitters = OS.get_cmdline_user_args().is_empty()
	if has_emitters:
		_add(ClamorProbe3D.new(), "Probe").position = Vector3(-3, 1, 2)
	var emitter := _add(ClamorEmitter3D.new(), "Tone")
	emitter.stream = tone if has_emitters else null
	emitter.position = Vector3(-2, 0, 0)
	var high := _add(ClamorEmitter3D.new(), "High")
	high.stream = tone.duplicate() if has_emitters else null  # no file, so that it is written
	high.baked_pitch_scale = 2
	_add(ClamorEmitter3D.new(), "Silent")
	_add(ClamorSource3D.new(), "Radio").position = Vector3(-3, 0, 2)
	_add(ClamorListener3D.new(), "Ears")

	var packed := PackedScene.new()
	packed.pack(scene)
	ResourceSaver.save(packed, "res://scene.tscn")
	var loaded: Node3D = load("res://scene.tscn").instantiate()
	get_root().add_child(loaded)
	scene.free()
	baker.baked.connect(func(_level: ClamorLevel3D, bake: ClamorBake) -> void: result = bake)


func _process(_delta: float) -> bool:
	frame += 1
	if frame == 3:  # CSG nodes make their meshes a frame late
		baker.bake(get_root().get_node("Scene"), "Draft")
	if frame < 3:
		return false
	if baker.is_baking():
		baker.poll()
		return false
	assert(not "Unbaked" in str(baker.findings) and not "there twice" in str(baker.findings))
	print(baker.findings.map(func(finding: Array) -> String: return finding[0]))
	if result == null:
		quit(1)
		return true
	var level: ClamorLevel3D = get_root().get_node("Scene/Level")
	level.bake = result
	for i in 100:
		OS.delay_msec(10)
		if level.get_state() != ClamorLevel3D.State.OPENING:
			break
	# The line about a material selects the mesh that has it.
	var about := baker.findings.filter(func(finding: Array) -> bool: return finding[0].begins_with("material 'Floor'"))
	assert(about.size() == 1 and about[0][1].name == "Floor")
	var info := level.get_info()
	print(info)
	var is_right: bool = info.emitters == (["Tone", "High"] if has_emitters else []) and info.portals == ["Opening"] and info.parts == ["Leaf"] \
		and info.sources > 1000 == has_emitters
	get_root().get_node("Scene").free()
	var folder := OS.get_cache_dir().path_join("clamor_bake_%d" % OS.get_process_id())
	var sidecar: Dictionary = JSON.parse_string(FileAccess.get_file_as_string(folder.path_join("level.acoustics.json")))
	is_right = is_right and sidecar.probes == [{"at": [-3.0, float(has_emitters), 2.0]}]
	if not has_emitters:
		is_right = is_right and baker.findings.any(func(finding: Array) -> bool: return finding[0].begins_with("Tone: "))
		quit(0 if is_right else 1)
		return true
	# A second of 440 Hz has become half a second of 880 Hz.
	var high := AudioStreamWAV.load_from_file(folder.path_join("1.wav"))
	var crossings := 0
	for i in range(2, high.data.size(), 2):
		crossings += int(high.data.decode_s16(i) >= 0 and high.data.decode_s16(i - 2) < 0)
	print("%.3f s, %d periods" % [high.get_length(), crossings])
	is_right = is_right and absf(high.get_length() - 0.5) < 1e-3 and absi(crossings - 440) < 2
	quit(0 if is_right and baker.findings.size() > 5 else 1)
	return true


func _add(node: Node, title: String) -> Node:
	node.name = title
	scene.add_child(node)
	node.owner = scene
	return node
