## Writes what is heard of a scene as a level for Clamor: a .glb with its surfaces, and a sidecar with
## emitters, materials, portals and doors, and copies of the sounds.
##
## The scene is read through Godot's nodes, because Godot's own glTF export leaves instances of a MultiMesh at
## the origin where nothing is drawn, keeps of metadata only `extras`, and has no sounds.
@tool
extends RefCounted

## What was found while writing: an array of [text, node].
var findings: Array[Array] = []
## Nodes, by the names that they and their materials have in the level.
var nodes := {}

var _root: Node3D
var _to_level: Transform3D
var _layers := 0xfffff
var _folder := ""
var _bytes: PackedByteArray = []
var _gltf := {
	"asset": {"version": "2.0", "generator": "Clamor for Godot"},
	"scene": 0, "scenes": [{"nodes": []}], "nodes": [], "meshes": [], "materials": [],
	"accessors": [], "bufferViews": [], "buffers": [],
}
var _sidecar := {"materials": {}, "emitters": [], "portals": [], "probes": [], "movable": []}
var _materials := {}  # numbers in the file, by Godot's material or name
var _meshes := {}  # numbers in the file, by mesh and materials
var _doors: Array[Node3D] = []


## Writes the scene of a level into a folder, and returns the path of the .glb.
func write(level: ClamorLevel3D, folder: String) -> String:
	_root = level.owner if level.owner is Node3D else level.get_parent() as Node3D
	if _root == null:
		_root = level
	_to_level = level.global_transform.orthonormalized().affine_inverse()
	_layers = level.bake_layers
	_folder = folder
	DirAccess.make_dir_recursive_absolute(folder)
	for pattern: String in level.materials:
		if level.materials[pattern] != null:
			_sidecar.materials[pattern] = level.materials[pattern].to_json()
	for door: Node in _root.find_children("*", "Node3D", true, false):
		if door is ClamorDoor3D and door.get_leaf() != null:
			_doors.append(door.get_leaf())
			_sidecar.movable.append(str(door.get_leaf().name))
	_visit(_root, _gltf.scenes[0].nodes, false)
	if _sidecar.emitters.is_empty() and _sidecar.probes.is_empty():
		_add_probe_of_source()
	_gltf.buffers = [{"byteLength": _bytes.size()}]
	if _gltf.accessors.is_empty():
		findings.append(["The scene has no surfaces: no visible meshes in the layers that are baked.", level])
	var path := folder.path_join("level.glb")
	_write_glb(path)
	var sidecar := FileAccess.open(folder.path_join("level.acoustics.json"), FileAccess.WRITE)
	sidecar.store_string(JSON.stringify(_sidecar, "  "))
	return path


# Adds a node's surfaces and sounds, and those below it. Surfaces of a door become children of a node of its own; those
# of a body that physics or the game moves are left out.
func _visit(node: Node, siblings: Array, moves: bool) -> void:
	var place := node as Node3D
	if place != null and not place.visible:
		return
	if place != null and place in _doors:
		var children := []
		var pivot := (_to_level * place.global_transform).orthonormalized()
		_add_node(siblings, str(place.name), pivot).children = children
		_add_surfaces(place, children, pivot.affine_inverse())
		for child in node.get_children():
			_visit_door(child, children, pivot.affine_inverse())
		if children.is_empty():
			_gltf.nodes.back().erase("children")
		return
	moves = moves or node is RigidBody3D or node is CharacterBody3D
	if place != null:
		if not moves:
			_add_surfaces(place, siblings, Transform3D.IDENTITY)
		if place is ClamorEmitter3D:
			_add_emitter(place)
		elif place is ClamorPortal3D:
			_add_portal(place)
		elif place is ClamorProbe3D:
			_sidecar.probes.append({"at": _list((_to_level * place.global_transform).origin)})
	for child in node.get_children():
		_visit(child, siblings, moves)


func _visit_door(node: Node, siblings: Array, to_pivot: Transform3D) -> void:
	if node is Node3D and not node.visible:
		return
	if node is Node3D:
		_add_surfaces(node, siblings, to_pivot)
	for child in node.get_children():
		_visit_door(child, siblings, to_pivot)


func _add_surfaces(node: Node3D, siblings: Array, to_parent: Transform3D) -> void:
	var visual := node as VisualInstance3D
	if visual != null and visual.layers & _layers == 0:
		return
	var place := to_parent * _to_level * node.global_transform
	if node is MeshInstance3D and node.mesh != null:
		_add_mesh(siblings, str(node.name), node.mesh, place, node)
	elif node is MultiMeshInstance3D and node.multimesh != null and node.multimesh.mesh != null:
		var many: MultiMesh = node.multimesh
		var count := many.instance_count if many.visible_instance_count < 0 else many.visible_instance_count
		# Without a screen, Godot knows of no instance but those in the buffer.
		var values := many.buffer
		@warning_ignore("integer_division")
		var stride := values.size() / maxi(many.instance_count, 1)
		for i in count if stride >= 12 else 0:
			var v := values.slice(i * stride, i * stride + 12)
			var there := Transform3D(Vector3(v[0], v[4], v[8]), Vector3(v[1], v[5], v[9]), Vector3(v[2], v[6], v[10]), Vector3(v[3], v[7], v[11]))
			_add_mesh(siblings, str(node.name), many.mesh, place * there, node)
	elif node is CSGShape3D and node.is_root_shape():
		var meshes: Array = node.get_meshes()
		if meshes.size() == 2 and meshes[1] != null:
			_add_mesh(siblings, str(node.name), meshes[1], place * meshes[0], node)
	elif node is GridMap:
		var cells: Array = node.get_meshes()
		for i in range(0, cells.size(), 2):
			_add_mesh(siblings, str(node.name), cells[i + 1], place * cells[i], node)


func _add_mesh(siblings: Array, title: String, mesh: Mesh, place: Transform3D, node: Node3D) -> void:
	var materials := []
	for i in mesh.get_surface_count():
		var material: Material = mesh.surface_get_material(i)
		if node is MeshInstance3D:
			material = node.get_active_material(i)
		elif node is GeometryInstance3D and node.material_override != null:
			material = node.material_override
		materials.append(_material(material, mesh, node))
	var key := [mesh, materials]
	if not _meshes.has(key):
		_meshes[key] = _write_mesh(mesh, materials)
	if _meshes[key] >= 0:
		_add_node(siblings, title, place).mesh = _meshes[key]
		nodes.get_or_add(title, node)


func _add_node(siblings: Array, title: String, place: Transform3D) -> Dictionary:
	var b := place.basis
	var o := place.origin
	siblings.append(_gltf.nodes.size())
	_gltf.nodes.append({"name": title, "matrix": [
		b.x.x, b.x.y, b.x.z, 0, b.y.x, b.y.y, b.y.z, 0, b.z.x, b.z.y, b.z.z, 0, o.x, o.y, o.z, 1]})
	return _gltf.nodes.back()


# The number of a mesh's triangles in the file, or -1 if it has none.
func _write_mesh(mesh: Mesh, materials: Array) -> int:
	var primitives := []
	for i in mesh.get_surface_count():
		if mesh is ArrayMesh and mesh.surface_get_primitive_type(i) != Mesh.PRIMITIVE_TRIANGLES:
			continue
		var arrays := mesh.surface_get_arrays(i)
		var vertices: PackedVector3Array = arrays[Mesh.ARRAY_VERTEX]
		if vertices.is_empty():
			continue
		var box := AABB(vertices[0], Vector3.ZERO)
		for vertex in vertices:
			box = box.expand(vertex)
		var primitive := {"material": materials[i], "attributes": {"POSITION": _accessor(
			vertices.to_byte_array(), vertices.size(), 5126, "VEC3",
			{"min": _list(box.position), "max": _list(box.end)})}}
		if arrays[Mesh.ARRAY_INDEX] != null and not arrays[Mesh.ARRAY_INDEX].is_empty():
			var indices: PackedInt32Array = arrays[Mesh.ARRAY_INDEX]
			primitive.indices = _accessor(indices.to_byte_array(), indices.size(), 5125, "SCALAR", {})
		primitives.append(primitive)
	if primitives.is_empty():
		return -1
	_gltf.meshes.append({"primitives": primitives})
	return _gltf.meshes.size() - 1


func _accessor(bytes: PackedByteArray, count: int, component: int, type: String, more: Dictionary) -> int:
	_gltf.bufferViews.append({"buffer": 0, "byteOffset": _bytes.size(), "byteLength": bytes.size()})
	_bytes.append_array(bytes)
	more.merge({"bufferView": _gltf.bufferViews.size() - 1, "componentType": component, "count": count, "type": type})
	_gltf.accessors.append(more)
	return _gltf.accessors.size() - 1


# The number of a material: one for each ClamorMaterial of its own, and otherwise one for each name.
func _material(material: Material, mesh: Mesh, node: Node3D) -> int:
	var own: ClamorMaterial = null
	for object: Object in [node, material, mesh]:
		if own == null and object != null and object.has_meta("clamor_material"):
			own = object.get_meta("clamor_material") as ClamorMaterial
	var title := _title(material)
	if title == "":
		title = _title(mesh)
	if title == "":
		title = str(node.name)
	var key: Variant = title if own == null else own
	if not _materials.has(key):
		if own != null:
			title = "%s (%d)" % [title, _materials.size()]
			_sidecar.materials[title] = own.to_json()
		_materials[key] = _gltf.materials.size()
		_gltf.materials.append({"name": title})
		nodes.get_or_add(title, node)
	return _materials[key]


static func _title(resource: Resource) -> String:
	if resource == null:
		return ""
	if resource.resource_name != "":
		return resource.resource_name
	return "" if resource.resource_path.contains("::") else resource.resource_path.get_file().get_basename()


func _add_emitter(emitter: ClamorEmitter3D) -> void:
	if emitter.stream == null:
		findings.append(["%s: the emitter has no stream, so it is left out." % emitter.name, emitter])
		return
	var sound := _write_sound(emitter)
	if sound == "":
		return
	nodes[emitter.get_emitter_name()] = emitter
	var place := _to_level * emitter.global_transform
	_sidecar.emitters.append({
		"name": emitter.get_emitter_name(), "signal": sound, "at": _list(place.origin), "facing": _list(-place.basis.z),
		"gain": "%fdB" % emitter.baked_volume_db, "directivity": emitter.directivity,
	})


# Copies the sound of an emitter. What is no file, or has another pitch, is written as Godot plays it. "" on errors.
func _write_sound(emitter: ClamorEmitter3D) -> String:
	var stream := emitter.stream
	var sound := "%d_%s" % [_sidecar.emitters.size(), stream.resource_path.get_file()]
	if stream.resource_path.get_extension() in ["wav", "ogg", "mp3", "flac"] and emitter.baked_pitch_scale == 1:
		if DirAccess.copy_absolute(ProjectSettings.globalize_path(stream.resource_path), _folder.path_join(sound)) == OK:
			return sound
		findings.append(["%s: %s cannot be copied." % [emitter.name, stream.resource_path], emitter])
		return ""
	if stream.get_length() <= 0:
		findings.append(["%s: the stream has no end, so it cannot be baked." % emitter.name, emitter])
		return ""
	var rate := roundi(AudioServer.get_mix_rate())
	var playback := stream.instantiate_playback()
	playback.start()
	var frames := playback.mix_audio(
		emitter.baked_pitch_scale, roundi(stream.get_length() * rate / emitter.baked_pitch_scale))
	sound = "%d.wav" % _sidecar.emitters.size()
	_write_wav(sound, rate, frames)
	return sound


# A bake begins at its emitters and probes. Where a scene has sources alone, a probe stands at the first.
func _add_probe_of_source() -> void:
	for source: Node in _root.find_children("*", "Node3D", true, false):
		if source is ClamorSource3D:
			_sidecar.probes.append({"at": _list((_to_level * source.global_transform).origin)})
			return


func _write_wav(file: String, rate: int, frames: PackedVector2Array) -> void:
	var wav := AudioStreamWAV.new()
	wav.format = AudioStreamWAV.FORMAT_16_BITS
	wav.mix_rate = rate
	var bytes := PackedByteArray()
	bytes.resize(2 * frames.size())
	for i in frames.size():
		bytes.encode_s16(2 * i, clampi(roundi(16383.5 * (frames[i].x + frames[i].y)), -32768, 32767))
	wav.data = bytes
	wav.save_to_wav(_folder.path_join(file))


func _add_portal(portal: ClamorPortal3D) -> void:
	nodes[portal.get_portal_name()] = portal
	var place := _to_level * portal.global_transform
	var values := {
		"name": portal.get_portal_name(), "at": _list(place.origin), "facing": _list(place.basis.z),
		"size": [portal.size.x, portal.size.y],
	}
	if portal.mode != ClamorPortal3D.Mode.PARTS:
		values.parts = []
	_sidecar.portals.append(values)


static func _list(vector: Vector3) -> Array:
	return [vector.x, vector.y, vector.z]


func _write_glb(path: String) -> void:
	for empty: String in _gltf.keys():
		if _gltf[empty] is Array and _gltf[empty].is_empty():
			_gltf.erase(empty)
	var json := JSON.stringify(_gltf).to_utf8_buffer()
	while json.size() % 4 != 0:
		json.append(0x20)
	var file := FileAccess.open(path, FileAccess.WRITE)
	file.store_buffer("glTF".to_ascii_buffer())
	file.store_32(2)
	file.store_32(12 + 8 + json.size() + 8 + _bytes.size())
	file.store_32(json.size())
	file.store_buffer("JSON".to_ascii_buffer())
	file.store_buffer(json)
	file.store_32(_bytes.size())
	file.store_buffer("BIN".to_ascii_buffer())
	file.store_8(0)
	file.store_buffer(_bytes)
