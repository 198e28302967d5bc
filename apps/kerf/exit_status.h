// What the program tells the shell.
#pragma once

#include <exception>

#include "kerf/base/result.h"
#include "kerf/base/shown_text.h"
#include "terminal.h"

namespace kerf::app {

inline constexpr int kSuccess = 0;
inline constexpr int kRunFailed = 1;
inline constexpr int kBadInput = 2;

/// Prints an error to stderr, after "kerf: ", and returns its exit status.
inline int report(const Error& error) {
  put(stderr, "kerf: " + shown_lines(error.message) + "\n");
  return error.kind == ErrorKind::kBadInput ? kBadInput : kRunFailed;
}

/// What the machine lacks, of which an exception tells; null: it is about something else.
const char* what_lacks(const std::exception& error);

}  // namespace kerf::app
