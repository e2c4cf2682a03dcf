# A ball that knocks where it bounces, the louder the faster it is.
extends RigidBody3D


func _ready() -> void:
	body_entered.connect(_knock)


func _knock(_body: Node) -> void:
	var speed := linear_velocity.length()
	if speed > 0.2:
		$Knock.volume_db = linear_to_db(minf(speed / 6, 1))
		$Knock.play()
	if speed < 1:
		apply_central_impulse(Vector3(randf_range(-0.4, 0.4), 5, randf_range(-0.4, 0.4)))
