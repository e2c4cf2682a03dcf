## Shapes in the 3D view: which way sources and emitters sound, the openings of portals, and the boxes round doors.
@tool
extends EditorNode3DGizmoPlugin


func _init() -> void:
	create_material("lines", Color("fc7f7f"))
	# Not loaded as resources, which they are not yet when a project is opened for the first time.
	for icon: String in ["door", "emitter", "source", "listener", "probe"]:
		var image := Image.new()
		image.load_svg_from_string(FileAccess.get_file_as_string("res://addons/clamor/icons/%s.svg" % icon), 4)
		create_icon_material(icon, ImageTexture.create_from_image(image))


func _get_gizmo_name() -> String:
	return "Clamor"


func _has_gizmo(node: Node3D) -> bool:
	return node is ClamorEmitter3D or node is ClamorSource3D or node is ClamorPortal3D or node is ClamorListener3D \
		or node is ClamorProbe3D or node is ClamorDoor3D


func _redraw(gizmo: EditorNode3DGizmo) -> void:
	gizmo.clear()
	var node := gizmo.get_node_3d()
	if node is ClamorPortal3D:
		var u := Vector3(node.size.x / 2, 0, 0)
		var v := Vector3(0, node.size.y / 2, 0)
		gizmo.add_lines([
			-u - v, u - v, u - v, u + v, u + v, v - u, v - u, -u - v, -u - v, u + v, u - v, v - u,
		], get_material("lines", gizmo))
	elif node is ClamorDoor3D:
		gizmo.add_unscaled_billboard(get_material("door", gizmo), 0.05)
		_add_box(gizmo, node)
	elif node is ClamorListener3D or node is ClamorProbe3D:
		gizmo.add_unscaled_billboard(get_material("listener" if node is ClamorListener3D else "probe", gizmo), 0.05)
	else:
		gizmo.add_unscaled_billboard(get_material("emitter" if node is ClamorEmitter3D else "source", gizmo), 0.05)
		gizmo.add_lines(_lobe(node.directivity), get_material("lines", gizmo))


func _add_box(gizmo: EditorNode3DGizmo, door: ClamorDoor3D) -> void:
	var faces := door.get_faces()
	if faces.is_empty():
		return
	var box := AABB(faces[0], Vector3.ZERO)
	for corner in faces:
		box = box.expand(corner)
	var lines: PackedVector3Array = []
	for corner in 8:
		for axis: int in [1, 2, 4]:
			if corner & axis == 0:
				lines.append_array([box.get_endpoint(corner), box.get_endpoint(corner | axis)])
	var from_leaf := door.global_transform.affine_inverse() * door.get_leaf().global_transform.orthonormalized()
	gizmo.add_lines(from_leaf * lines, get_material("lines", gizmo))


# How loud a directivity is in each direction of the horizontal and the vertical plane, as a radius.
static func _lobe(exponent: float) -> PackedVector3Array:
	var lines: PackedVector3Array = []
	for axis: Vector3 in [Vector3.RIGHT, Vector3.UP]:
		for i in 48:
			for step: int in [i, i + 1]:
				var angle := TAU * step / 48
				var amplitude := pow((1 + cos(angle)) / 2, exponent / 2)
				lines.append(amplitude * (Vector3.FORWARD * cos(angle) + axis * sin(angle)))
	return lines
