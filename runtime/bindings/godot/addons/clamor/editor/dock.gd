## The dock with what a bake has found. A click selects the node that a line is about.
@tool
extends Tree

signal node_chosen(node: Node)


func _ready() -> void:
	hide_root = true
	item_selected.connect(_choose)


## Shows findings, an array of [text, node].
func show_findings(findings: Array[Array]) -> void:
	clear()
	create_item()
	for finding in findings:
		_add(finding[0]).set_metadata(0, finding[1] if is_instance_valid(finding[1]) else null)
	if findings.is_empty():
		_add("Bake the scene to see here what was found in it.").set_selectable(0, false)


func _add(text: String) -> TreeItem:
	var item := create_item()
	item.set_text(0, text)
	item.set_autowrap_mode(0, TextServer.AUTOWRAP_WORD_SMART)
	return item


func _choose() -> void:
	var node: Variant = get_selected().get_metadata(0)
	if is_instance_valid(node):
		node_chosen.emit(node)
