#!/usr/bin/env bash
# libmysofa 1.3.1: a delay that is said to be in seconds is in frames, and the one in frames is 44100 times that.
#
# Data.Delay of a SOFA file (AES69, SimpleFreeFieldHRIR) counts samples. The library's page says that
# mysofa_getfilter_float() gives delays in seconds and mysofa_getfilter_short() in samples. The first gives what stands
# in the file, converted to the rate that was asked for, so frames; the second multiplies that by the rate once more.
# For the 20 and 35 frames that the head below is late in its two ears, a caller reads 20 s and 35 s, or 882000 and
# 1543500 frames. The MIT KEMAR that comes with the library has no delays, and so do many heads, which hides it.
#
# It concerns all who play heads whose common delay or interaural time is in Data.Delay, as minimum-phase sets have it.
# Take what mysofa_getfilter_float() gives as frames at the rate of mysofa_open(), and do not call
# mysofa_getfilter_short(). Clamor reads SOFA files by itself, and Data.Delay in samples.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
for package in libmysofa1=1.3.1~dfsg0-1 libmysofa-dev=1.3.1~dfsg0-1; do apt-get -qq download $package 2>/dev/null; done
for package in *.deb; do dpkg -x "$package" .; done
npm install --silent --no-audit --no-fund --prefix . h5wasm@0.10.3

cat >late.mjs <<'EOF'
import h5wasm from "h5wasm/node";
import {copyFileSync} from "node:fs";
await h5wasm.ready;
copyFileSync("usr/share/libmysofa/MIT_KEMAR_normal_pinna.sofa", "late.sofa");
const head = new h5wasm.File("late.sofa", "a");
head.get("Data.Delay").write_slice([[0, 1], [0, 2]], new Float64Array([20, 35]));
head.close();
const again = new h5wasm.File("late.sofa", "r");
console.log(`${again.attrs.SOFAConventions.value}, ${again.get("Data.SamplingRate").value[0]} Hz, Data.Delay ${again.get("Data.Delay").value.join(" and ")}`);
again.close();
process.exit(0);
EOF
cat >delay.c <<'EOF'
#include <mysofa.h>
#include <stdio.h>
#include <stdlib.h>

int main(void) {
  for (int i = 0; i < 2; ++i) {
    const float rate = i ? 88200 : 44100;
    int length, problem, frames[2];
    struct MYSOFA_EASY *head = mysofa_open("late.sofa", rate, &length, &problem);
    if (!head) return 1;
    float *left = calloc(length, sizeof *left), *right = calloc(length, sizeof *right), seconds[2];
    short *short_left = calloc(length, sizeof *short_left), *short_right = calloc(length, sizeof *short_right);
    mysofa_getfilter_float(head, 1, 0, 0, left, right, &seconds[0], &seconds[1]);
    mysofa_getfilter_short(head, 1, 0, 0, short_left, short_right, &frames[0], &frames[1]);
    printf("%.0f Hz: mysofa_getfilter_float %g and %g, mysofa_getfilter_short %d and %d\n", rate, seconds[0],
      seconds[1], frames[0], frames[1]);
    mysofa_close(head);
  }
}
EOF
library=usr/lib/x86_64-linux-gnu
cc -O1 -Iusr/include delay.c -o delay $library/libmysofa.so.1
{ node late.mjs && LD_LIBRARY_PATH=$library ./delay; } | tee seen
cat >expected <<'EOF'
SimpleFreeFieldHRIR, 44100 Hz, Data.Delay 20 and 35
44100 Hz: mysofa_getfilter_float 20 and 35, mysofa_getfilter_short 882000 and 1543500
88200 Hz: mysofa_getfilter_float 40 and 70, mysofa_getfilter_short 3528000 and 6174000
EOF
cmp -s seen expected || { echo "The delays that libmysofa gives have changed."; exit 1; }
