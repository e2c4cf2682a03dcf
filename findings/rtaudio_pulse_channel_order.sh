#!/usr/bin/env bash
# RtAudio 5.2.0 on PulseAudio 16.1: of four channels the second comes from the centre, and the third from the right.
#
# RtAudio opens a stream of PulseAudio without a channel map, and has no call that says which channel is which.
# PulseAudio then takes the order of AIFF: four channels are left, centre, right and rear centre, six are left, left of
# centre, centre, right, right of centre and rear centre. Through ALSA, the same program's are left, right, rear left, rear
# right, centre and LFE. Sound in the order of WAV files (left, right, centre, LFE, rear left, rear right) comes from other
# loudspeakers either way: below, channel n of a stream is the constant n / 10, and in a room of 5.1 the right loudspeaker
# plays the rear left channel of four, and the LFE of six, at full level. RtAudio says that this room has six channels,
# and asks PulseAudio before ALSA if the program leaves the choice to it.
#
# It concerns all who play more than two channels on Linux with RtAudio. Play through PulseAudio's own library with a map
# (PA_CHANNEL_MAP_WAVEEX), and put the channels in ALSA's order for ALSA. Clamor plays through PulseAudio's library.
set -euo pipefail
for command in c++ pulseaudio pactl parec; do command -v $command >/dev/null || { echo "install $command"; exit 1; }; done
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
for package in librtaudio6=5.2.0~ds1-2 librtaudio-dev=5.2.0~ds1-2; do apt-get -qq download $package 2>/dev/null; done
for package in *.deb; do dpkg -x "$package" .; done

cat >play.cpp <<'EOF'
#include <RtAudio.h>

#include <chrono>
#include <cstdlib>
#include <thread>

// Channel c of n is the constant (c + 1) / 10 until standard input ends.
static int block(void* output, void*, unsigned frames, double, RtAudioStreamStatus, void* count) {
  const int channels = *static_cast<int*>(count);
  for (unsigned i = 0; i < frames * channels; ++i) static_cast<float*>(output)[i] = 0.1f * (i % channels + 1);
  return 0;
}

int main(int, char** arguments) {
  int channels = std::atoi(arguments[2]);
  RtAudio audio(RtAudio::getCompiledApiByName(arguments[1]));
  RtAudio::StreamParameters parameters;
  parameters.deviceId = audio.getDefaultOutputDevice();
  parameters.nChannels = channels;
  unsigned frames = 512;
  audio.openStream(&parameters, nullptr, RTAUDIO_FLOAT32, 48000, &frames, &block, &channels);
  audio.startStream();
  while (std::getchar() != EOF) {}
  audio.closeStream();
}
EOF
library=usr/lib/x86_64-linux-gnu
c++ -O1 -Iusr/include/rtaudio play.cpp -o play $library/librtaudio.so.6
export HOME=$folder XDG_RUNTIME_DIR=$folder LC_ALL=C
unset PULSE_SERVER PULSE_RUNTIME_PATH
printf 'pcm.!default {type pulse}\nctl.!default {type pulse}\n' >.asoundrc  # ALSA plays through PulseAudio, too
order=front-left,front-right,front-center,lfe,rear-left,rear-right
pulseaudio -n --daemonize=no --exit-idle-time=5 --load="module-native-protocol-unix" \
  --load="module-null-sink sink_name=room rate=48000 channels=6 channel_map=$order" 2>log &
server=$!
until pactl info >/dev/null 2>&1; do kill -0 $server || exit 1; sleep 0.2; done

for api in pulse alsa; do
  for channels in 4 6; do
    mkfifo hold
    ./play $api $channels <hold 2>/dev/null &
    exec 3>hold
    until pactl list sink-inputs | grep -q 'Channel Map'; do kill -0 $! || exit 1; sleep 0.2; done
    echo "$channels channels by $api are $(pactl list sink-inputs | sed -n 's/.*Channel Map: //p')"
    [[ $api == alsa ]] || echo "  left, right, centre, LFE, rear left and rear right loudspeaker: $(
      parec -d room.monitor --format=float32le --rate=48000 --channels=6 --channel-map=$order --raw 2>/dev/null |
        od -An -f -w24 -v | awk '$1 > 0.09 && ++settled == 48000 { printf "%.2f %.2f %.2f %.2f %.2f %.2f", $1, $2, $3, $4, $5, $6; exit }'
    )"
    exec 3>&-
    wait %./play
    rm hold
  done
done | tee seen
kill $server
wait
cat >expected <<'EOF'
4 channels by pulse are front-left,front-center,front-right,rear-center
  left, right, centre, LFE, rear left and rear right loudspeaker: 0.10 0.30 0.22 0.00 0.10 0.30
6 channels by pulse are front-left,front-left-of-center,front-center,front-right,front-right-of-center,rear-center
  left, right, centre, LFE, rear left and rear right loudspeaker: 0.10 0.40 0.33 0.00 0.15 0.45
4 channels by alsa are front-left,front-right,rear-left,rear-right
6 channels by alsa are front-left,front-right,rear-left,rear-right,front-center,lfe
EOF
cmp -s seen expected || { echo "The order of RtAudio's channels in PulseAudio has changed."; exit 1; }
