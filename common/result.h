// result.h: a value or an error sentence.
//
// Bad input is an Error that travels up as a value; each layer may add its context with in().
// Errors may quote untrusted names, so control characters are replaced (printable.h). A broken
// contract between our own functions is an assert, not an Error.
#pragma once

#include <cassert>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>

#include "common/printable.h"

namespace clamor {

// One sentence: where, what, found, expected, and the next step.
struct Error {
  explicit Error(std::string_view text) : message(printable(text)) {}

  // Prefixes the message with `where: `, as in "level.gltf: ...".
  Error in(std::string_view where) const { return Error(std::string(where) + ": " + message); }

  std::string message;
};

template <class T>
class [[nodiscard]] Result {
 public:
  Result(T value) : content_(std::move(value)) {}
  Result(Error error) : content_(std::move(error)) {}

  bool ok() const { return std::holds_alternative<T>(content_); }
  explicit operator bool() const { return ok(); }

  T& operator*() & { return value(); }
  const T& operator*() const& { return value(); }
  T&& operator*() && { return std::move(value()); }
  T* operator->() { return &value(); }
  const T* operator->() const { return &value(); }

  const Error& error() const {
    assert(!ok());
    return *std::get_if<Error>(&content_);
  }

 private:
  T& value() {
    assert(ok());
    return *std::get_if<T>(&content_);
  }
  const T& value() const {
    assert(ok());
    return *std::get_if<T>(&content_);
  }

  std::variant<T, Error> content_;
};

template <>
class [[nodiscard]] Result<void> {
 public:
  Result() = default;
  Result(Error error) : error_(std::move(error)) {}

  bool ok() const { return !error_.has_value(); }
  explicit operator bool() const { return ok(); }
  const Error& error() const {
    assert(!ok());
    return *error_;
  }

 private:
  std::optional<Error> error_;
};

// The name in single quotes, printable, for messages. (Argument-dependent lookup would find
// std::quoted under the shorter name.)
inline std::string in_quotes(std::string_view name) {
  return std::string("'").append(printable(name)).append("'");
}

}  // namespace clamor
