## Makes a node that moves (a door, a lift, a lorry) hide and reflect sound wherever it is.
##
## Add it below the node that moves. All meshes below that node belong to it. The Bake button leaves them
## out of the level, as if all doors were open.
@tool
@icon("icons/door.svg")
class_name ClamorDoor3D
extends Node3D

## The node that moves, with its meshes. Empty: the parent of this node.
@export var leaf: Node3D:
	set(value):
		leaf = value
		update_gizmos()
		update_configuration_warnings()

## How much quieter sound is behind one of its surfaces. A door that is modelled as a box has two of them.
@export_range(0, 60, 0.1, "suffix:dB") var transmission_loss_db := 15.0

## Share of the energy that its surfaces keep instead of reflecting it.
@export_range(0, 1, 0.01) var absorption := 0.1

## Whether it hides anything.
@export var enabled := true:
	set(value):
		enabled = value
		ClamorServer.enable_part(_part, value)

var _part := 0
var _level_number := 0
var _place := Transform3D()


## The node that moves.
func get_leaf() -> Node3D:
	return leaf if leaf != null else get_parent() as Node3D


## Triangles of all meshes below the node that moves, relative to it as it stands, with its scale.
func get_faces() -> PackedVector3Array:
	var faces: PackedVector3Array = []
	if get_leaf() == null or not get_leaf().is_inside_tree():
		return faces
	var to_leaf := get_leaf().global_transform.orthonormalized().affine_inverse()
	for shape in _shapes(get_leaf()):
		var meshes: Array = [Transform3D.IDENTITY, shape.mesh] if shape is MeshInstance3D else shape.get_meshes()
		if meshes.size() == 2 and meshes[1] != null:
			faces.append_array(to_leaf * shape.global_transform * meshes[0] * meshes[1].get_faces())
	return faces


func _process(_delta: float) -> void:
	if Engine.is_editor_hint() or get_leaf() == null:
		return
	var level := ClamorLevel3D._get_open()
	if level == null:
		return
	var place := ClamorLevel3D.to_level(get_leaf().global_transform).orthonormalized()
	if level._number != _level_number:
		if get_faces().is_empty() and not _shapes(get_leaf()).is_empty():
			return  # CSG shapes have no mesh in their first frame
		_level_number = level._number
		_begin(place)
	elif place == _place:
		return
	_place = place
	ClamorServer.move_part(_part, place.origin, place.basis.get_rotation_quaternion())


func _exit_tree() -> void:
	ClamorServer.remove_part(_part)
	_part = 0
	_level_number = 0


func _get_configuration_warnings() -> PackedStringArray:
	if get_leaf() == null:
		return ["Add the node below the one that moves, or set the property Leaf."]
	if _shapes(get_leaf()).is_empty():
		return ["%s has no meshes below it, so it hides nothing." % get_leaf().name]
	return []


# Takes the bake's part of the leaf's name, or adds one.
func _begin(place: Transform3D) -> void:
	ClamorServer.remove_part(_part)
	_part = ClamorServer.find_part(_level_number, get_leaf().name)
	if _part == 0:
		var options := {
			"transmission": db_to_linear(-2 * transmission_loss_db), "node": str(get_path()),
			"absorption": maxf(absorption, db_to_linear(-2 * transmission_loss_db)),
		}
		_part = ClamorServer.add_part(get_faces(), options, place.origin, place.basis.get_rotation_quaternion())
	ClamorServer.enable_part(_part, enabled)


static func _shapes(node: Node3D) -> Array[Node]:
	var nodes: Array[Node] = [node]
	nodes.append_array(node.find_children("*", "GeometryInstance3D", true, false))
	return nodes.filter(func(shape: Node) -> bool:
		return shape is MeshInstance3D and shape.mesh != null or shape is CSGShape3D and shape.is_root_shape())
