// A bound body in a file, so that pre-processing runs once (as in the paper).
//
// Layout, little-endian: 8 bytes "KERFBODY", version (u32), flags (u32, 1: closed), mean root edge (f64); then every array of the
// cell complex in the order of CellComplex::for_each_array, each as item count (u64), item size (u32) and the items; then
// the report (its times are 0: the same meshes give the same bytes; what was led and squashed from version 3 on); then what the body is made of (from version 2 on): u8 (1 Young's modulus, 2 Poisson's ratio, 4 density, 8 lattice are known),
// three f64, and the lattice's origin and cell (six f64) and counts (three i32), 0 where unknown; then a 64-bit hash of all that precedes.
// Runs of pools are three i32: first, count, reversed.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "kerf/binding/bind.h"
#include "kerf/mesh/models.h"

namespace kerf {

inline constexpr std::uint32_t kBoundBodyVersion = 3;

/// What whoever bound a body knew about it: scenes use it where they say nothing else.
struct BodyNature {
  std::optional<double> young;    ///< pascals, > 0
  std::optional<double> poisson;  ///< 1, between -1 and 0.5
  std::optional<double> density;  ///< kg/m3, > 0
  std::optional<LatticeHint> lattice;
};

/// Writes a freshly bound body (no cuts), without the times of its report. The file appears complete or not at all: it is written beside its place and renamed.
Status save_bound_body(const BoundBody& body, const std::filesystem::path& file, const BodyNature& nature = {});
/// The bytes of that file, for parse_bound_body.
std::string bound_body_bytes(const BoundBody& body, const BodyNature& nature = {});

/// Reads it back, to the bit; files of version 1 too, of which nothing else is known. Closed bodies of versions 1 and 2 keep the parameters of an unsquashed
/// surface: a warning says so. The displacement is measured, not read. Bad input, naming the file: cannot be opened, not such a file, another version, truncated, damaged
/// (hash), or contents that validate_binding refuses. Never reads more than the file holds.
Result<BoundBody> load_bound_body(const std::filesystem::path& file, BodyNature* nature = nullptr);
/// The same for bytes in memory; `name` stands for the file in messages.
Result<BoundBody> parse_bound_body(std::string_view bytes, const std::string& name, BodyNature* nature = nullptr);

}  // namespace kerf
