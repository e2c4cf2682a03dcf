// maths_series-inl.h: log2 and exp2 of a float, or of each element of a compiler's vector of
// floats.
//
// maths.h includes this text into namespace clamor, and maths_lanes-inl.h into the namespace of
// each instruction set, since a function of one instruction set cannot take the vectors of another.

// log2(x) for normal x > 0. Error below 2e-7 times max(1, |log2(x)|), and relative error below 3e-7
// near 1.
//
// With x = 2^e m and sqrt(1/2) <= m < sqrt(2): log(m) = 2 artanh((m - 1) / (m + 1)).
template <class F>
CLAMOR_INLINE F log2_of(F x) {
  constexpr bool kIsScalar = std::is_same_v<F, float>;
  using Ints = std::conditional_t<kIsScalar, int, decltype(x < x)>;
  const Ints bits = __builtin_bit_cast(Ints, x);
  const Ints exponent = (bits - 0x3f3504f3) >> 23;
  const F m = __builtin_bit_cast(F, bits - (exponent << 23));
  const F t = (m - 1.0f) / (m + 1.0f);
  const F t2 = t * t;
  const F series = 2.88539008f + t2 * (0.961796694f +
                                       t2 * (0.577078016f + t2 * (0.412198583f + t2 * 0.3205989f)));
  if constexpr (kIsScalar)
    return static_cast<float>(exponent) + t * series;
  else
    return __builtin_convertvector(exponent, F) + t * series;
}

// 2^x, relative error below 2e-7; x is clamped to [-126, 126], that of vectors to >= -126 only.
//
// With x = n + f and |f| <= 1/2: 2^x = 2^n 2^f, by the Taylor series of exp(f ln 2).
template <class F>
CLAMOR_INLINE F exp2_of(F x) {
  constexpr bool kIsScalar = std::is_same_v<F, float>;
  using Ints = std::conditional_t<kIsScalar, int, decltype(x < x)>;
  const F low = F{} - 126.0f;
  x = x < low ? low : x;
  if constexpr (kIsScalar) x = x > 126 ? 126 : x;
  const F rounded = x + 12582912.0f;  // n is in the lowest bits
  const F f = x - (rounded - 12582912.0f);
  const F f2 = f * f;  // Estrin's scheme, half as deep as Horner's
  const F series =
      ((1.0f + f * 0.693147181f) + f2 * (0.240226507f + f * 5.55041087e-2f)) +
      f2 * f2 *
          ((9.61812911e-3f + f * 1.33335581e-3f) + f2 * (1.54035304e-4f + f * 1.52527338e-5f));
  return series * __builtin_bit_cast(F, (__builtin_bit_cast(Ints, rounded) + 127) << 23);
}
