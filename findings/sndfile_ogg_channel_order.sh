#!/usr/bin/env bash
# libsndfile 1.2.0: 5.1 that is written as Ogg has the centre and the right exchanged, and the LFE on the left rear.
#
# Vorbis (Vorbis I, 4.3.9) and Opus (RFC 7845, 5.1.1.2) say what the channels of a stream are: left, centre, right, left
# rear, right rear, LFE. WAV and FLAC files have left, right, centre, LFE, left rear, right rear. libsndfile hands
# channels on as they come, from and to all formats, so that a copy of a WAV file as Ogg, by sf_readf_float() and
# sf_writef_float(), plays five of six channels elsewhere, and Ogg files of other encoders are read out of order as well.
# The same holds for three, five, seven and eight channels. The channel map of SFC_SET_CHANNEL_MAP_INFO, which would tell,
# is refused for Ogg, and the pages of the library do not speak of the order.
#
# It concerns who keeps beds of ambience or loudspeaker mixes as Ogg. Put the channels in the order of Vorbis oneself, or
# write FLAC. Clamor averages the channels of a source's sound, whatever their order is.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
for package in libsndfile1=1.2.0-1+deb12u1 libsndfile1-dev=1.2.0-1+deb12u1; do apt-get -qq download $package 2>/dev/null; done
for package in *.deb; do dpkg -x "$package" .; done
npm install --silent --no-audit --no-fund --prefix . audio-decode@3.12.0 node-web-audio-api@2.2.0

cat >write.c <<'EOF'
#include <math.h>
#include <sndfile.h>
#include <stdio.h>
#include <stdlib.h>

/* Channel c sounds in tenth c of a second. */
static void write_file(const char *path, int format, int channels) {
  static const int map[6] = {SF_CHANNEL_MAP_LEFT, SF_CHANNEL_MAP_RIGHT, SF_CHANNEL_MAP_CENTER, SF_CHANNEL_MAP_LFE,
    SF_CHANNEL_MAP_REAR_LEFT, SF_CHANNEL_MAP_REAR_RIGHT};
  SF_INFO info = {.samplerate = 48000, .channels = channels, .format = format};
  SNDFILE *file = sf_open(path, SFM_WRITE, &info);
  if (!file) exit(1);
  printf("%s: the channel map is %s\n", path,
    sf_command(file, SFC_SET_CHANNEL_MAP_INFO, (void *)map, channels * sizeof *map) == SF_TRUE ? "taken" : "refused");
  float *sound = calloc(48000 * channels, sizeof *sound);
  for (int i = 0; i < 4800 * channels; ++i) sound[i * channels + i / 4800] = 0.5 * sin(2 * 3.14159265358979 * 100 * i / 48000);
  sf_writef_float(file, sound, 48000);
  sf_close(file);
}

int main(void) {
  write_file("wav", SF_FORMAT_WAVEX | SF_FORMAT_FLOAT, 6);
  write_file("flac", SF_FORMAT_FLAC | SF_FORMAT_PCM_16, 6);
  write_file("vorbis", SF_FORMAT_OGG | SF_FORMAT_VORBIS, 6);
  write_file("opus", SF_FORMAT_OGG | SF_FORMAT_OPUS, 6);
}
EOF
cat >read.mjs <<'EOF'
import decode from "audio-decode";
import {readFileSync} from "node:fs";
import {OfflineAudioContext} from "node-web-audio-api";
const names = ["left", "right", "centre", "LFE", "left rear", "right rear"];
// What each channel that a decoder gives holds of what was written.
const order = (channels) => channels.map((channel, c) => {
  const energies = names.map((_, tenth) => channel.slice(4800 * tenth + 600, 4800 * tenth + 4200).reduce((sum, x) => sum + x * x, 0));
  const loudest = energies.indexOf(Math.max(...energies));
  return `${names[c]} <- ${names[loudest]}`;
}).join(", ");
for (const name of ["wav", "flac", "vorbis", "opus"]) {
  const bytes = readFileSync(name);
  console.log(`${name} by audio-decode: ${order((await decode(bytes)).channelData)}`);
  if (name === "opus") continue;  // which the other one does not read
  const buffer = await new OfflineAudioContext(6, 48000, 48000).decodeAudioData(new Uint8Array(bytes).buffer);
  console.log(`${name} by node-web-audio-api: ${order(names.map((_, c) => buffer.getChannelData(c)))}`);
}
process.exit(0);
EOF
library=usr/lib/x86_64-linux-gnu
cc -O1 -Iusr/include write.c -o write $library/libsndfile.so.1 -lm
{ LD_LIBRARY_PATH=$library ./write && node read.mjs; } | tee seen
cat >expected <<'EOF'
wav: the channel map is taken
flac: the channel map is refused
vorbis: the channel map is refused
opus: the channel map is refused
wav by audio-decode: left <- left, right <- right, centre <- centre, LFE <- LFE, left rear <- left rear, right rear <- right rear
wav by node-web-audio-api: left <- left, right <- right, centre <- centre, LFE <- LFE, left rear <- left rear, right rear <- right rear
flac by audio-decode: left <- left, right <- right, centre <- centre, LFE <- LFE, left rear <- left rear, right rear <- right rear
flac by node-web-audio-api: left <- left, right <- right, centre <- centre, LFE <- LFE, left rear <- left rear, right rear <- right rear
vorbis by audio-decode: left <- left, right <- centre, centre <- right, LFE <- right rear, left rear <- LFE, right rear <- left rear
vorbis by node-web-audio-api: left <- left, right <- centre, centre <- right, LFE <- right rear, left rear <- LFE, right rear <- left rear
opus by audio-decode: left <- left, right <- centre, centre <- right, LFE <- right rear, left rear <- LFE, right rear <- left rear
EOF
cmp -s seen expected || { echo "The order of channels that libsndfile writes has changed."; exit 1; }
