#!/usr/bin/env bash
# Godot 4.6.3: without a screen, the instances of a MultiMesh are at the origin, or nowhere.
#
# With --headless, MultiMesh.set_instance_transform() does nothing, and get_instance_transform() returns the identity
# for each instance, also for those of a scene that was loaded; get_aabb() is empty. No error or warning says so. What
# was given as `buffer`, as scene files do, is kept, and written again. With a screen, all of them agree.
#
# It concerns scripts that measure, convert, export or test scenes where there is no screen, as in continuous
# integration and on servers: glTF files that Godot exports there have all instances at the origin, and spawn points,
# navigation or sounds that follow instances lie there. Read and write `buffer`: twelve numbers for an instance, the
# rows of its transform, before colours and custom data. Clamor's Bake button does so.
set -euo pipefail
command -v godot >/dev/null || { echo "install godot of Debian sid"; exit 1; }
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
export HOME=$folder

cat >instances.gd <<'EOF'
extends SceneTree

func _initialize() -> void:
	var many := MultiMesh.new()
	many.transform_format = MultiMesh.TRANSFORM_3D
	many.instance_count = 1
	many.set_instance_transform(0, Transform3D(Basis.IDENTITY, Vector3(5, 6, 7)))
	print("set by set_instance_transform: ", many.get_instance_transform(0).origin, ", buffer of ", many.buffer.size())
	many.buffer = PackedFloat32Array([1, 0, 0, 5, 0, 1, 0, 6, 0, 0, 1, 7])
	print("set by buffer: ", many.get_instance_transform(0).origin, ", buffer has ", many.buffer[3], ", ", many.buffer[7], ", ", many.buffer[11])
	quit()
EOF

godot --headless --no-header -s instances.gd 2>&1 | grep "^set" | tee seen
cat >expected <<'EOF'
set by set_instance_transform: (0.0, 0.0, 0.0), buffer of 0
set by buffer: (0.0, 0.0, 0.0), buffer has 5.0, 6.0, 7.0
EOF
cmp -s seen expected || { echo "Where a MultiMesh's instances are without a screen has changed."; exit 1; }
