# Walks with WASD, and looks where the mouse moves.
extends CharacterBody3D

const METRES_PER_SECOND := 2.0


func _ready() -> void:
	Input.mouse_mode = Input.MOUSE_MODE_CAPTURED


func _physics_process(_delta: float) -> void:
	var ahead := Vector3.ZERO
	for key: Array in [[KEY_W, Vector3.FORWARD], [KEY_S, Vector3.BACK], [KEY_A, Vector3.LEFT], [KEY_D, Vector3.RIGHT]]:
		if Input.is_physical_key_pressed(key[0]):
			ahead += key[1]
	velocity = basis * ahead.normalized() * METRES_PER_SECOND
	move_and_slide()


func _unhandled_input(event: InputEvent) -> void:
	if event is InputEventMouseMotion:
		rotate_y(-0.003 * event.relative.x)
		$Camera.rotation.x = clampf($Camera.rotation.x - 0.003 * event.relative.y, -1.4, 1.4)
