#!/usr/bin/env bash
# SDL 2.26.5: an SDL_AudioStream from 48 to 44.1 kHz loses 78 ms of a minute, and clicks 60 times a second.
#
# A stream converts what it is given in blocks, below of 512 frames, and rounds the frames of each block down. What is
# between two blocks is left out: a tone has steps, and is 1001.3 Hz instead of 1000 Hz. From 44.1 to 48 kHz, 25 ms are
# lost of a minute; from 48 to 24 kHz, where a block becomes a whole number of frames, nothing is. An audio device that is
# opened without SDL_AUDIO_ALLOW_FREQUENCY_CHANGE is fed by such a stream, so that sound and picture, or sound and a
# clock that counts the frames that were played, part by a second in a quarter of an hour.
#
# It concerns SDL programs of Debian 12 whose sound and device differ in rate. Set SDL_HINT_AUDIO_RESAMPLING_MODE to
# "best" before SDL_Init(), for which SDL takes libsamplerate, or let SDL change the frequency and mix at the device's.
# Issue 7358 of SDL shows that blocks give another sound than a whole file does.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
for package in libsdl2-2.0-0=2.26.5+dfsg-1 libsdl2-dev=2.26.5+dfsg-1; do apt-get -qq download $package 2>/dev/null; done
for package in *.deb; do dpkg -x "$package" .; done

cat >stream.c <<'EOF'
#include <SDL2/SDL.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

/* Converts a minute of 1 kHz in blocks of 480 frames. */
static void convert(int from_hz, int to_hz, const char *mode) {
  const int frames = 60 * from_hz;
  SDL_AudioStream *stream = SDL_NewAudioStream(AUDIO_F32SYS, 1, from_hz, AUDIO_F32SYS, 1, to_hz);
  float block[480];
  for (int i = 0; i < frames; i += 480) {
    for (int k = 0; k < 480; ++k) block[k] = 0.5 * sin(2 * 3.14159265358979 * 1000 * (i + k) / from_hz);
    SDL_AudioStreamPut(stream, block, sizeof block);
  }
  SDL_AudioStreamFlush(stream);
  const int made = SDL_AudioStreamAvailable(stream) / 4;
  float *sound = malloc(made * sizeof *sound);
  SDL_AudioStreamGet(stream, sound, made * sizeof *sound);
  /* A sine is 2 cos(w) times its last sample, less the one before; a step is not. */
  int first = 0, last = 0, waves = 0, steps = 0, step = 0;
  const double w = 2 * 3.14159265358979 * 1000 / to_hz;
  for (int i = 2000; i < made - 2000; ++i) {
    if (fabs(sound[i] - 2 * cos(w) * sound[i - 1] + sound[i - 2]) > 0.01 && (steps == 0 || i > step + 20)) step = i, ++steps;
    if (!(sound[i - 1] < 0 && sound[i] >= 0)) continue;
    if (first) ++waves;
    else first = i;
    last = i;
  }
  printf("%d to %d Hz%s: %.3f s, %.1f Hz, %.0f clicks a second\n", from_hz, to_hz, mode ? ", best" : "",
    (double)made / to_hz, (double)waves * to_hz / (last - first), 10 * round(steps / 600.0));
}

int main(int count, char **arguments) {
  const char *mode = count > 1 ? arguments[1] : NULL;
  if (mode) SDL_SetHint(SDL_HINT_AUDIO_RESAMPLING_MODE, mode);
  if (SDL_Init(SDL_INIT_AUDIO)) return 1; /* which reads the hint */
  convert(48000, 24000, mode);
  convert(44100, 48000, mode);
  convert(48000, 44100, mode);
  SDL_Quit();
}
EOF
library=usr/lib/x86_64-linux-gnu
cc -O1 -Iusr/include -Iusr/include/x86_64-linux-gnu stream.c -o stream $library/libSDL2-2.0.so.0 -lm
export LD_LIBRARY_PATH=$library SDL_AUDIODRIVER=dummy
{ ./stream && ./stream best; } | tee seen
cat >expected <<'EOF'
48000 to 24000 Hz: 60.000 s, 1000.0 Hz, 0 clicks a second
44100 to 48000 Hz: 59.975 s, 1000.5 Hz, 60 clicks a second
48000 to 44100 Hz: 59.922 s, 1001.3 Hz, 60 clicks a second
48000 to 24000 Hz, best: 59.994 s, 1000.0 Hz, 0 clicks a second
44100 to 48000 Hz, best: 60.002 s, 1000.0 Hz, 0 clicks a second
48000 to 44100 Hz, best: 59.997 s, 1000.0 Hz, 0 clicks a second
EOF
cmp -s seen expected || { echo "What a stream of SDL keeps has changed."; exit 1; }
