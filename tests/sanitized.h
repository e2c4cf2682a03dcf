// sanitized.h: whether a sanitizer of memory watches, which GCC and Clang say in ways of their own.
#pragma once

namespace clamor::testing {

#if defined(__SANITIZE_ADDRESS__)
inline constexpr bool kSanitized = true;
#elif defined(__has_feature)
inline constexpr bool kSanitized = __has_feature(address_sanitizer);
#else
inline constexpr bool kSanitized = false;
#endif

}  // namespace clamor::testing
