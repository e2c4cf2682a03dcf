#!/usr/bin/env bash
# libmysofa 1.3.1: one head is 6 dB louder at twice the rate, and 3 dB louder with its loudness normalised.
#
# mysofa_open_no_norm() resamples the responses of a SOFA file to the rate that the caller asks for, as if they were
# sounds: their samples keep their values, and there are more of them. A filter is a sum over its samples, so that its
# gain grows with the rate: from 44.1 kHz to 48 kHz by 0.7 dB, to 96 kHz by 6.8 dB, at every frequency. mysofa_open(),
# which most programs call, makes the energy of the samples 1 afterwards, which halves the error but does not mend it.
# The head below is the library's own, the MIT KEMAR, which was measured at 44.1 kHz.
#
# It concerns who plays at more than one rate, mixes sounds through a head with sounds that do not pass through it, or
# compares heads. Multiply what mysofa_open_no_norm() gives by the file's rate, and divide it by the rate that was asked
# for. Clamor reads SOFA files by itself, and does not resample their responses.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
for package in libmysofa1=1.3.1~dfsg0-1 libmysofa-dev=1.3.1~dfsg0-1; do apt-get -qq download $package 2>/dev/null; done
for package in *.deb; do dpkg -x "$package" .; done

cat >gain.c <<'EOF'
#include <math.h>
#include <mysofa.h>
#include <stdio.h>
#include <stdlib.h>

/* The left ear's gains at two frequencies for sound from ahead, in decibels. */
static void gains(double *gain, int normalised, float rate) {
  int length, problem;
  const char *path = "usr/share/libmysofa/MIT_KEMAR_normal_pinna.sofa";
  struct MYSOFA_EASY *head = normalised ? mysofa_open(path, rate, &length, &problem)
                                        : mysofa_open_no_norm(path, rate, &length, &problem);
  if (!head) exit(1);
  float *left = calloc(length, sizeof *left), *right = calloc(length, sizeof *right), delays[2];
  mysofa_getfilter_float(head, 1, 0, 0, left, right, &delays[0], &delays[1]);
  for (int i = 0; i < 2; ++i) {
    const double radians = 2 * 3.14159265358979 * (i ? 4000 : 500) / rate;
    double real = 0, imaginary = 0;
    for (int k = 0; k < length; ++k) {
      real += left[k] * cos(radians * k);
      imaginary += left[k] * sin(radians * k);
    }
    gain[i] = 10 * log10(real * real + imaginary * imaginary);
  }
  mysofa_close(head);
}

int main(void) {
  for (int normalised = 0; normalised < 2; ++normalised) {
    double known[2], seen[2];
    gains(known, normalised, 44100);
    for (int i = 0; i < 4; ++i) {
      const float rate = (float[]){22050, 48000, 88200, 96000}[i];
      gains(seen, normalised, rate);
      printf("%s, %.0f Hz against 44100 Hz: %+.1f dB at 500 Hz, %+.1f dB at 4 kHz; the rates' ratio is %+.1f dB\n",
        normalised ? "mysofa_open" : "mysofa_open_no_norm", rate, seen[0] - known[0], seen[1] - known[1],
        20 * log10(rate / 44100));
    }
  }
}
EOF
library=usr/lib/x86_64-linux-gnu
cc -O1 -Iusr/include gain.c -o gain $library/libmysofa.so.1 -lm
LD_LIBRARY_PATH=$library ./gain | tee seen
cat >expected <<'EOF'
mysofa_open_no_norm, 22050 Hz against 44100 Hz: -6.1 dB at 500 Hz, -6.0 dB at 4 kHz; the rates' ratio is -6.0 dB
mysofa_open_no_norm, 48000 Hz against 44100 Hz: +0.7 dB at 500 Hz, +0.7 dB at 4 kHz; the rates' ratio is +0.7 dB
mysofa_open_no_norm, 88200 Hz against 44100 Hz: +6.0 dB at 500 Hz, +6.0 dB at 4 kHz; the rates' ratio is +6.0 dB
mysofa_open_no_norm, 96000 Hz against 44100 Hz: +6.8 dB at 500 Hz, +6.8 dB at 4 kHz; the rates' ratio is +6.8 dB
mysofa_open, 22050 Hz against 44100 Hz: -2.7 dB at 500 Hz, -2.6 dB at 4 kHz; the rates' ratio is -6.0 dB
mysofa_open, 48000 Hz against 44100 Hz: +0.4 dB at 500 Hz, +0.4 dB at 4 kHz; the rates' ratio is +0.7 dB
mysofa_open, 88200 Hz against 44100 Hz: +3.0 dB at 500 Hz, +3.0 dB at 4 kHz; the rates' ratio is +6.0 dB
mysofa_open, 96000 Hz against 44100 Hz: +3.4 dB at 500 Hz, +3.4 dB at 4 kHz; the rates' ratio is +6.8 dB
EOF
cmp -s seen expected || { echo "The level of a head by its rate has changed."; exit 1; }
