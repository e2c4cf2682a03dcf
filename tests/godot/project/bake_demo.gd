# Bakes the scene of the demo in place of the bake that lies beside it, as the Bake button does. A first bake is
# cancelled, and leaves the old one as it was.
extends SceneTree

const Baker := preload("res://addons/clamor/editor/baker.gd")

var baker := Baker.new()
var frame := 0
var was_cancelled := false
var bake_before := FileAccess.get_md5("res://demo.clamor")


func _initialize() -> void:
	var demo: Node3D = load("res://demo.tscn").instantiate()
	demo.process_mode = Node.PROCESS_MODE_DISABLED  # as in the editor
	get_root().add_child(demo)


func _process(_delta: float) -> bool:
	frame += 1
	if frame == 3 or frame > 3 and not baker.is_baking() and not was_cancelled:
		was_cancelled = frame > 3
		baker.bake(get_root().get_node("Demo"), "Draft" if was_cancelled else "Final")
		if not was_cancelled:
			baker.cancel()
	baker.poll()
	if frame < 3 or baker.is_baking():
		return false
	if not was_cancelled:
		print(baker.findings)
		assert(baker.findings[0][0].contains("cancel") and FileAccess.get_md5("res://demo.clamor") == bake_before)
		return false
	var found := baker.findings.map(func(finding: Array) -> String: return finding[0])
	print(found)
	quit(0 if found[0].begins_with("res://demo.clamor was baked") and not "Warning" in str(found) else 1)
	return true
