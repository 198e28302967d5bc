// What every step of a cut needs, and how it reports a refused degenerate case.
#pragma once

#include <span>
#include <string>

#include "kerf/base/result.h"
#include "kerf/binding/cell_complex.h"
#include "kerf/cutting/cut_options.h"
#include "kerf/cutting/cut_scratch.h"

namespace kerf::cut {

/// Steps return false (or no id) after fail(); the caller rolls back with the journal.
struct CutContext {
  CellComplex& body;
  const CutOptions& options;
  CutScratch& scratch;
  std::span<const Vec3>
      drawn{};  ///< where the blade was, in order, metres, at rest: what is cut is drawn along that; empty: along chords
  const char* reason = nullptr;
  const char* element = "";
  std::int32_t id = -1;

  bool fail(const char* why, const char* what, std::int32_t which) {
    reason = why;
    element = what;
    id = which;
    return false;
  }
};

/// The - side is mirrored so that its patches are positively oriented.
inline Vec2 mirrored(Vec2 u, Side s) { return s == Side::kPlus ? u : Vec2{u.x, -u.y}; }
inline int side_count(const CellComplex& body) { return body.closed ? 2 : 1; }

}  // namespace kerf::cut
