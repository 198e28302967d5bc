// What the program tells the shell.
#pragma once

#include <exception>
#include <string>

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

/// Prints notes and warnings to stderr, one "note: " line each; with --quiet, too.
template <class Notes>
void say_notes(const Notes& notes) {
  for (const std::string& note : notes) warn("note: {}\n", note);
}

/// What --quiet leaves out, for the help of every command that has it.
inline constexpr const char* kQuietHelp =
    "No progress and no summary; notes, warnings and errors are still said, on the error stream";

/// What the machine lacks, of which an exception tells; null: it is about something else.
const char* what_lacks(const std::exception& error);

}  // namespace kerf::app
