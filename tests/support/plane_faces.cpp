#include "support/plane_faces.h"

#include <CGAL/Arr_segment_traits_2.h>
#include <CGAL/Arr_walk_along_line_point_location.h>
#include <CGAL/Arrangement_2.h>
#include <CGAL/Exact_predicates_exact_constructions_kernel.h>

#include <vector>

namespace kerf::testing_support {
namespace {

using Kernel = CGAL::Exact_predicates_exact_constructions_kernel;
using Traits = CGAL::Arr_segment_traits_2<Kernel>;
using Arrangement = CGAL::Arrangement_2<Traits>;

}  // namespace

struct PlaneFaces::Impl {
  Arrangement arrangement;
  CGAL::Arr_walk_along_line_point_location<Arrangement> location{arrangement};
};

PlaneFaces::PlaneFaces(std::span<const std::array<Vec2, 2>> segments) : impl_(std::make_unique<Impl>()) {
  std::vector<Traits::X_monotone_curve_2> curves;
  for (const auto& [a, b] : segments)
    if (!(a == b)) curves.emplace_back(Kernel::Point_2(a.x, a.y), Kernel::Point_2(b.x, b.y));
  CGAL::insert(impl_->arrangement, curves.begin(), curves.end());
}
PlaneFaces::~PlaneFaces() = default;

const void* PlaneFaces::face_of(Vec2 p) const {
  const auto found = impl_->location.locate(Kernel::Point_2(p.x, p.y));
  const auto* face = boost::get<Arrangement::Face_const_handle>(&found);
  return face == nullptr ? nullptr : &**face;
}
std::size_t PlaneFaces::count() const { return impl_->arrangement.number_of_faces(); }

}  // namespace kerf::testing_support
