// result.h: a value, or a sentence that says why there is none.
//
// Bad input is an Error that travels up as a value; each layer may put what it knows in front
// with in(). Names in it may come from anywhere: what steers terminals or ends lines is taken out
// (printable.h). A broken promise between our own functions is an assert, not an Error.
#pragma once

#include <cassert>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>

#include "common/printable.h"

namespace clamor {

// One sentence: what, where, found, expected, and what to do next.
struct Error {
  explicit Error(std::string_view text) : message(printable(text)) {}

  // The same error with `where: ` in front, as in "level.gltf: ...".
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

// 'name', for messages, printable. (std::quoted would be found first under that name.)
inline std::string in_quotes(std::string_view name) {
  return std::string("'").append(printable(name)).append("'");
}

}  // namespace clamor
