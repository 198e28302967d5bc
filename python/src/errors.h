// Errors of the library as Python exceptions.
#pragma once

#include <exception>
#include <string>
#include <utility>

#include "kerf/base/result.h"

namespace kerf::python {

/// Becomes kerf.Error.
class Failure : public std::exception {
 public:
  explicit Failure(Error error) : error_(std::move(error)) {}
  [[nodiscard]] const char* what() const noexcept override { return error_.message.c_str(); }
  [[nodiscard]] const Error& error() const { return error_; }

 private:
  Error error_;
};

/// Has the translator of Failure installed; once.
void translate_failures();

inline void check(const Status& status) {
  if (!status) throw Failure(status.error());
}
template <class T>
T value_of(Result<T> result) {
  if (!result) throw Failure(result.error());
  return std::move(result).value();
}

}  // namespace kerf::python
