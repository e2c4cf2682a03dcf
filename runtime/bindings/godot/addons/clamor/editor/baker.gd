## Bakes the acoustics of a scene beside its file, in the background.
@tool
extends RefCounted

## The state, or what was found, has changed.
signal changed
## A level has been baked.
signal baked(level: ClamorLevel3D, bake: ClamorBake)

## Secondary sources that a bake keeps at most, by the names of qualities. 0: as many as suit the level.
const QUALITIES := {"Draft": 20000, "Final": 0}

## What was found: an array of [text, node], of which the node may be null.
var findings: Array[Array] = []
## Share of the bake that is done.
var fraction := 0.0

var _level: ClamorLevel3D
var _output := ""
var _folder := ""
var _nodes := {}


## Whether a bake is under way.
func is_baking() -> bool:
	return _level != null


## Begins to bake the scene with this root. It must have been saved, and must have a ClamorLevel3D.
func bake(root: Node, quality: String) -> void:
	findings.clear()
	var levels: Array[Node] = [] if root == null else root.find_children("*", "Node3D", true, false)
	levels = levels.filter(func(node: Node) -> bool: return node is ClamorLevel3D)
	if root is ClamorLevel3D:
		levels.push_front(root)
	if levels.is_empty():
		_fail("The scene has no ClamorLevel3D node. Add one, and press Bake again.", root)
	elif root.scene_file_path == "":
		_fail("Save the scene first: its bake will lie beside it.", root)
	else:
		_begin(levels[0], root.scene_file_path.get_basename() + ".clamor", QUALITIES[quality])
	changed.emit()


## Ends a bake that is under way, within a second or a few of them.
func cancel() -> void:
	ClamorServer.cancel_bake()


## Takes over what the bake has done. To be called in each frame.
func poll() -> void:
	if _level == null:
		return
	var status := ClamorServer.get_bake_status()
	if status.running:
		if roundi(100 * status.fraction) != roundi(100 * fraction):
			fraction = status.fraction
			changed.emit()
		return
	var level := _level
	_level = null
	for warning: String in status.warnings:
		var text := warning.replace("in the sidecar", "in the level's Materials")
		findings.append(["Warning: " + text, _named_in(warning, level)])
	for note: String in status.notes:
		if not note.begins_with("sidecar "):
			var own := "(sidecar '%s')" % note.get_slice("'", 1)
			findings.append([note.replace(own, "(ClamorMaterial)").replace("(sidecar", "(the level's"), _named_in(note, null)])
	if status.error == "":
		var bake := ResourceLoader.load(_output, "", ResourceLoader.CACHE_MODE_REUSE) as ClamorBake
		findings.push_front(["%s was baked in %.0f s." % [_output, status.seconds], level])
		baked.emit(level, bake)
	else:
		findings.push_front([status.error, level])
	changed.emit()


func _begin(level: ClamorLevel3D, output: String, sources: int) -> void:
	_output = output
	_folder = OS.get_cache_dir().path_join("clamor_bake_%d" % OS.get_process_id())
	var Writer := load("res://addons/clamor/editor/scene_writer.gd")
	var writer: RefCounted = Writer.new()
	var path: String = writer.write(level, _folder)
	findings.append_array(writer.findings)
	_nodes = writer.nodes
	var spacing: float = level.probe_spacing if level.probe_spacing > 0 else -1.0
	var error: String = ClamorServer.start_bake(path, ProjectSettings.globalize_path(output), sources, spacing)
	if error != "":
		_fail(error, level)
		return
	fraction = 0
	_level = level


func _fail(text: String, node: Node) -> void:
	findings.append([text, node])


# The node that a sentence is about, since it has its name or that of its material in quotes.
func _named_in(sentence: String, otherwise: Node) -> Node:
	for part in sentence.split("'"):
		if is_instance_valid(_nodes.get(part)):
			return _nodes[part]
	return otherwise
