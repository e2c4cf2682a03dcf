## The dock with what a bake has found. A click selects the node that a line is about.
@tool
extends ItemList

signal node_chosen(node: Node)

var _nodes: Array[Node] = []


func _ready() -> void:
	auto_width = false
	text_overrun_behavior = TextServer.OVERRUN_NO_TRIMMING
	item_selected.connect(_choose)


## Shows findings, an array of [text, node].
func show_findings(findings: Array[Array]) -> void:
	clear()
	_nodes.clear()
	for finding in findings:
		var node: Node = finding[1] if is_instance_valid(finding[1]) else null
		add_item(finding[0])
		set_item_tooltip(item_count - 1, finding[0])
		_nodes.append(node)
	if findings.is_empty():
		add_item("Bake the scene to see here what was found in it.", null, false)


func _choose(index: int) -> void:
	if index < _nodes.size() and is_instance_valid(_nodes[index]):
		node_chosen.emit(_nodes[index])
