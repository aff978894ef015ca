#pragma once

#include <string>
#include <utility>
#include <variant>

#include "base/expects.h"

namespace mocap {

/// Kind of an external failure; the caller decides to retry, continue without, or end.
enum class ErrorCode {
  InvalidArgument,  ///< a setting, file or request that cannot be right
  NotFound,         ///< no such camera, file, feature
  Unsupported,      ///< it exists, but cannot do what was requested
  Timeout,          ///< no answer in time; a retry may succeed
  DeviceLost,       ///< it disappeared; open it again
  Busy,             ///< in use by another program (a camera, a port)
  Io,               ///< the system refused a read, write or call
  EndOfStream,      ///< a finite source is exhausted
};

/// The name of a code, as written in logs.
const char* name_of(ErrorCode code) noexcept;

/// An external failure, returned to the caller who can decide.
struct Error {
  ErrorCode code;
  std::string message;  ///< names the object, the value, the expectation and the remedy
};

/// A value or an error. The member names are those of std::expected, which will replace this class.
template <class T, class E = Error>
class [[nodiscard]] Result {
 public:
  Result(T value) : state_(std::in_place_index<0>, std::move(value)) {}
  Result(E error) : state_(std::in_place_index<1>, std::move(error)) {}

  bool has_value() const noexcept { return state_.index() == 0; }
  explicit operator bool() const noexcept { return has_value(); }

  T& value() & { return checked(); }
  const T& value() const& { return std::as_const(*this).checked(); }
  T&& value() && { return std::move(checked()); }
  T& operator*() & { return checked(); }
  const T& operator*() const& { return std::as_const(*this).checked(); }
  T&& operator*() && { return std::move(checked()); }
  T* operator->() { return &checked(); }
  const T* operator->() const { return &checked(); }

  const E& error() const {
    MOCAP_EXPECTS(!has_value());
    return *std::get_if<1>(&state_);
  }

 private:
  T& checked() {
    MOCAP_EXPECTS(has_value());
    return *std::get_if<0>(&state_);
  }
  const T& checked() const {
    MOCAP_EXPECTS(has_value());
    return *std::get_if<0>(&state_);
  }

  std::variant<T, E> state_;
};

/// Success or an error.
template <class E>
class [[nodiscard]] Result<void, E> {
 public:
  Result() = default;
  Result(E error) : state_(std::in_place_index<1>, std::move(error)) {}

  bool has_value() const noexcept { return state_.index() == 0; }
  explicit operator bool() const noexcept { return has_value(); }

  const E& error() const {
    MOCAP_EXPECTS(!has_value());
    return *std::get_if<1>(&state_);
  }

 private:
  std::variant<std::monostate, E> state_;
};

using Status = Result<void>;

}  // namespace mocap
