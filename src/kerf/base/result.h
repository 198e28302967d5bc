// Bad input and failed computations travel as values. An Error names what is wrong, where (file, line,
// element) and the way out; programmer errors are KERF_ASSERT instead.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <variant>

#include "kerf/base/check.h"

namespace kerf {

enum class ErrorKind {
  kBadInput,  ///< a file, scene, mesh or command that can't be used: exit status 2
  kFailed,    ///< a computation that could not be finished: exit status 1
};

struct Error {
  ErrorKind kind = ErrorKind::kBadInput;
  std::string message;  ///< one sentence: what, where, and what to do about it
};

inline Error bad_input(std::string message) { return {ErrorKind::kBadInput, std::move(message)}; }
inline Error failed(std::string message) { return {ErrorKind::kFailed, std::move(message)}; }

/// A value or an Error.
template <class T>
class [[nodiscard]] Result {
 public:
  Result(T value) : state_(std::move(value)) {}
  Result(Error error) : state_(std::move(error)) {}

  [[nodiscard]] bool ok() const { return state_.index() == 0; }
  explicit operator bool() const { return ok(); }

  [[nodiscard]] T& value() & {
    KERF_ASSERT(ok());
    return *std::get_if<0>(&state_);
  }
  [[nodiscard]] const T& value() const& {
    KERF_ASSERT(ok());
    return *std::get_if<0>(&state_);
  }
  [[nodiscard]] T&& value() && {
    KERF_ASSERT(ok());
    return std::move(*std::get_if<0>(&state_));
  }
  T* operator->() { return &value(); }
  const T* operator->() const { return &value(); }
  T& operator*() & { return value(); }
  const T& operator*() const& { return value(); }
  T&& operator*() && { return std::move(*this).value(); }

  [[nodiscard]] const Error& error() const {
    KERF_ASSERT(!ok());
    return *std::get_if<1>(&state_);
  }

 private:
  std::variant<T, Error> state_;
};

/// Success or an Error.
class [[nodiscard]] Status {
 public:
  Status() = default;
  Status(Error error) : error_(std::move(error)) {}
  [[nodiscard]] bool ok() const { return !error_; }
  explicit operator bool() const { return ok(); }
  [[nodiscard]] const Error& error() const {
    KERF_ASSERT(!ok());
    return *error_;
  }

 private:
  std::optional<Error> error_;
};

}  // namespace kerf

/// Returns the error of a Status or Result expression from the enclosing function, if it has one.
#define KERF_TRY(expression)                                                                   \
  do {                                                                                         \
    if (auto kerf_try_status = (expression); !kerf_try_status) return kerf_try_status.error(); \
  } while (false)
