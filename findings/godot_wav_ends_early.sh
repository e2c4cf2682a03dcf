#!/usr/bin/env bash
# Godot 4.6.3: an AudioStreamWAV begins two frames late, and its last two to six frames are not played.
#
# That is so at the rate of the mix, too, where there is nothing to resample. What is lost depends on the length: no
# frame of up to 126, two where the length is a multiple of 128, and up to six otherwise. The cubic interpolation of the
# playback reads blocks of 128 frames, is two frames behind them, and stops before it has come to their end.
#
# It concerns who plays sounds one after another without a gap, or compares what a game plays with a file, and sounds
# that end where they are loud, which end in a click. Add six frames of silence to them. Loops are not concerned.
# Clamor takes 2 frames off what it decodes, and its tests know where a sound ends.
set -euo pipefail
command -v godot >/dev/null || { echo "install godot of Debian sid"; exit 1; }
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
export HOME=$folder

cat >ends.gd <<'EOF'
extends SceneTree

func _initialize() -> void:
	for frames: int in [100, 1000, 1280, 44100]:
		var samples := PackedByteArray()
		samples.resize(2 * frames)
		for i in frames:
			samples.encode_s16(2 * i, 16384)
		var sound := AudioStreamWAV.new()
		sound.format = AudioStreamWAV.FORMAT_16_BITS
		sound.mix_rate = int(AudioServer.get_mix_rate())
		sound.data = samples
		var playback := sound.instantiate_playback()
		playback.start()
		var played := Array(playback.mix_audio(1, 65536)).map(func(frame: Vector2) -> bool: return frame.x > 0.25)
		print("%d frames: %d are played, after %d of silence" % [frames, played.count(true), played.find(true)])
	quit()
EOF

godot --headless --no-header -s ends.gd 2>&1 | grep frames: | tee seen
cat >expected <<'EOF'
100 frames: 100 are played, after 2 of silence
1000 frames: 994 are played, after 2 of silence
1280 frames: 1278 are played, after 2 of silence
44100 frames: 44094 are played, after 2 of silence
EOF
cmp -s seen expected || { echo "Where an AudioStreamWAV ends has changed."; exit 1; }
