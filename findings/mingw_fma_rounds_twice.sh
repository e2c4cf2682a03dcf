#!/usr/bin/env bash
# mingw-w64 10.0.0: fma(x, y, z) is wrong more often than x * y + z is.
#
# The C standard has fma() round once, as if to infinite precision, and that is what it is called for:
# fma(x, y, -(x * y)) is the rounding error of a product. The library of mingw-w64 in Debian 12, which GCC links
# wherever it may not assume an FMA instruction (without -mfma), splits factors and sums up their parts in x87
# registers, where sums are rounded to 64 and then to 53 bits. Of 20000 sums 19 % come out on the wrong side of the
# true one, where a product and a sum that are rounded separately do so in 4 %. Of the rounding errors of products,
# which are exact numbers, 11 % are wrong. glibc's function has no wrong one among them.
#
# It concerns double-double arithmetic, compensated sums, robust geometric predicates, and everybody who compares
# results of Windows with those of Linux. Compile with -mfma where all processors have it, or split the factors by
# Dekker's algorithm, which needs nothing but products and sums.
set -euo pipefail
command -v x86_64-w64-mingw32-gcc-posix wine >/dev/null ||
  { echo "install gcc-mingw-w64-x86-64-posix and wine64 of Debian 12"; exit 1; }
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
apt-get -qq download mingw-w64-x86-64-dev=10.0.0-3 2>/dev/null
dpkg -x mingw-w64-x86-64-dev_10.0.0-3_all.deb .

cat >count.c <<'EOF'
#include <math.h>
#include <stdint.h>
#include <stdio.h>

static uint64_t state = 1;
static double random_of_52_bits(void) { /* from 1 to 2 */
  state = state * 6364136223846793005u + 1442695040888963407u;
  return 1 + (double)(state >> 12) * 0x1p-52;
}
static __int128 integer(double x) { return (__int128)(int64_t)(x * 0x1p52); } /* x below 2^11 */

int main(void) {
  int sums = 0, naive = 0, products = 0;
  for (int i = 0; i < 20000; ++i) {
    volatile double x = random_of_52_bits(), y = random_of_52_bits(), z = 16 * random_of_52_bits();
    /* In units of 2^-104: the exact x y + z, of which the result may be at most half a unit of its 53 bits away. */
    const __int128 exact = integer(x) * integer(y) + (integer(z) << 52), half = (__int128)1 << (51 + 4);
    volatile double by_fma = fma(x, y, z), product = x * y, by_two = product + z;
    if (by_fma < 32) { /* where the result's last place is 2^-48 */
      const __int128 off = (integer(by_fma) << 52) - exact, off_two = (integer(by_two) << 52) - exact;
      sums += off > half || off < -half;
      naive += off_two > half || off_two < -half;
    }
    const double error = (double)(int64_t)(integer(x) * integer(y) - (integer(product) << 52)) * 0x1p-104;
    products += fma(x, y, -product) != error;
  }
  printf("of 20000: sums wrong %d by fma, %d by x * y + z; errors of products wrong %d\n", sums, naive, products);
}
EOF
x86_64-w64-mingw32-gcc-posix -O2 count.c -o count.exe -Lusr/x86_64-w64-mingw32/lib
cc -O2 -ffp-contract=off count.c -o count -lm
WINEPREFIX=$folder/wine WINEDEBUG=-all WINEDLLOVERRIDES='mscoree,mshtml=' wine count.exe | tr -d '\r' | sed 's/^/mingw-w64 10.0.0: /' | tee seen
WINEPREFIX=$folder/wine wineserver -k || true
./count | sed 's/^/this C library: /' | tee -a seen
cat >expected <<'EOF'
mingw-w64 10.0.0: of 20000: sums wrong 3812 by fma, 858 by x * y + z; errors of products wrong 2108
this C library: of 20000: sums wrong 0 by fma, 858 by x * y + z; errors of products wrong 0
EOF
cmp -s seen expected || { echo "What fma() of mingw-w64 or of this C library rounds has changed."; exit 1; }
