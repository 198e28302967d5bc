// A bound body in a file, so that pre-processing runs once (as in the paper).
//
// Layout, little-endian: 8 bytes "KERFBODY", version (u32), flags (u32, 1: closed), mean root edge (f64); then every array of the
// cell complex in the order of CellComplex::for_each_array, each as item count (u64), item size (u32) and the items; then
// the report; then a 64-bit hash of all that precedes. Runs of pools are three i32: first, count, reversed.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "kerf/binding/bind.h"

namespace kerf {

inline constexpr std::uint32_t kBoundBodyVersion = 1;

/// Writes a freshly bound body (no cuts). The file appears complete or not at all: it is written beside its place and renamed.
Status save_bound_body(const BoundBody& body, const std::filesystem::path& file);

/// Reads it back, to the bit. Bad input, naming the file: cannot be opened, not such a file, another version, truncated, damaged
/// (hash), or contents that validate_binding refuses. Never reads more than the file holds.
Result<BoundBody> load_bound_body(const std::filesystem::path& file);
/// The same for bytes in memory; `name` stands for the file in messages.
Result<BoundBody> parse_bound_body(std::string_view bytes, const std::string& name);

}  // namespace kerf
