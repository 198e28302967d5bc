// The faces into which segments divide the plane, exactly: CGAL's arrangements with exact arithmetic.
#pragma once

#include <array>
#include <memory>
#include <span>

#include "kerf/base/vec.h"

namespace kerf::testing_support {

class PlaneFaces {
 public:
  explicit PlaneFaces(std::span<const std::array<Vec2, 2>> segments);
  ~PlaneFaces();
  PlaneFaces(const PlaneFaces&) = delete;
  PlaneFaces& operator=(const PlaneFaces&) = delete;

  /// Two points lie in one face exactly if this is the same; null on a segment.
  [[nodiscard]] const void* face_of(Vec2 p) const;
  [[nodiscard]] std::size_t count() const;  ///< the unbounded one included

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace kerf::testing_support
