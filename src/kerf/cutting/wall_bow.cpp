#include "kerf/cutting/wall_bow.h"

#include <algorithm>
#include <cmath>

#include "kerf/cutting/chain_split.h"
#include "kerf/cutting/tolerances.h"

namespace kerf::cut {
namespace {

using CH = CollisionHalfEdge;
using VH = VisualHalfEdge;

/// A wall before it is built: its columns 0 to `last`, and the skin beside their ends.
class WallOutline {
 public:
  WallOutline(CutContext& cut, CH h)
      : cut_(cut), h_(h), mesh_(cut.body.visual), coarse_(cut.body.collision), scratch_(cut.scratch),
        last_(coarse_.chain[h][0].count + 1) {
    const CollisionVertex ends[2] = {coarse_.from(h), coarse_.to(h)};
    for (std::size_t e = 0; e < 2; ++e) {
      const auto bound = coarse_.bound[ends[e]];
      rim_[e] = bound[0] == bound[1];
      end_[e] = rim_[e] ? mesh_.rest[bound[0]] : coarse_.rest[ends[e]];
    }
    const Vec3 along = coarse_.rest[ends[1]] - coarse_.rest[ends[0]];
    length_ = norm(along);
    along_ = normalized(along);
    half_thickness_ = 0.5 * norm(coarse_.offset[ends[0]] + coarse_.offset[ends[1]]);
    find_skin();
  }

  void find_bows() {
    auto& along = scratch_.bow_along;  // shares of the way to the mid-surface: along the path, and across it
    auto& across = scratch_.bow_across;
    auto& middle = scratch_.bow_middle;
    along.clear();
    across.clear();
    middle.clear();
    double highest = -HUGE_VAL;
    bool straight = true;
    for (std::int32_t k = 0; k <= last_; ++k) {
      middle.push_back(straight_middle(k));
      const double height = height_over_skin(k, middle.back());
      const bool blocked = height > 0, ahead = !is_on_rim(k) && is_ahead(k, middle.back());
      across.push_back(blocked ? 1 : 0);
      along.push_back(blocked || ahead ? 1 : 0);
      straight = straight && !blocked && !ahead;
      highest = std::max(highest, height);
    }
    if (straight) return;
    spread(along);
    spread(across);
    for (std::int32_t k = 0; k <= last_; ++k) {
      const Vec3 way = mid_surface(k) - middle[at(k)], forwards = dot(way, along_) * along_;
      middle[at(k)] += along[at(k)] * forwards + across[at(k)] * (way - forwards);
    }
    for (std::size_t e = 0; e < 2; ++e)
      if (rim_[e]) clear_rim(e, middle);
    for (std::int32_t k = 0; k <= last_; ++k)
      if (!(height_over_skin(k, middle[at(k)]) < std::max(highest, 0.0))) return;  // no better than straight
    for (std::int32_t k = 0; k <= last_; ++k) scratch_.bow[at(k)] = to_float(middle[at(k)] - straight_middle(k));
  }

 private:
  static std::size_t at(std::int32_t k) { return static_cast<std::size_t>(k); }
  [[nodiscard]] Vec3 end_of_column(std::size_t side, std::int32_t k) const {
    return mesh_.rest[scratch_.chain[side][at(k)]];
  }
  [[nodiscard]] Vec3 straight_middle(std::int32_t k) const {
    return lerp(end_of_column(0, k), end_of_column(1, k), 0.5);
  }
  [[nodiscard]] Vec3 mid_surface(std::int32_t k) const { return lerp(end_[0], end_[1], parameter(k)); }
  /// Is a column's middle far from its place of the mid-surface, along the path? Beyond a rim it may be in the open.
  [[nodiscard]] bool is_ahead(std::int32_t k, Vec3 middle) const {
    return std::fabs(dot(mid_surface(k) - middle, along_)) > kBowAhead * half_thickness_;
  }
  /// There a column is one vertex.
  [[nodiscard]] bool is_on_rim(std::int32_t k) const { return (k == 0 && rim_[0]) || (k == last_ && rim_[1]); }
  [[nodiscard]] double parameter(std::int32_t k) const {
    return k <= 0 ? 0 : k >= last_ ? 1 : chain_parameter(cut_.body, h_, Side::kPlus, scratch_.chain[0][at(k)]);
  }

  /// Four faces touch a column's chains between one column and the next: above and below, left and right.
  void find_skin() {
    auto& skin = scratch_.bow_skin;
    skin.clear();
    for (std::int32_t k = 0; k < last_; ++k)
      for (std::size_t s = 0; s < 2; ++s)
        for (const VH x : {scratch_.left[s][at(k)], scratch_.right[s][at(k)]}) {
          const Vec3 a = mesh_.rest[mesh_.origin[x]], b = mesh_.rest[mesh_.to(x)],
                     c = mesh_.rest[mesh_.origin[VisualMesh::prev(x)]];
          const Vec3 n = cross(b - a, c - a);
          const double size = norm(n);
          skin.push_back(size > 0 ? (1 / size) * n : Vec3{});
        }
  }
  /// Calls f(unit normal, a point) for the faces that touch the chains at a column.
  template <class Fn>
  void for_each_face(std::int32_t k, Fn&& f) const {
    for (std::int32_t strip = std::max(0, k - 1); strip <= std::min(k, last_ - 1); ++strip)
      for (std::size_t i = 0; i < 4; ++i) f(scratch_.bow_skin[4 * at(strip) + i], end_of_column(i / 2, k));
  }
  /// Metres by which a column's middle is above one of these faces, margin included; > 0: they are in the way.
  [[nodiscard]] double height_over_skin(std::int32_t k, Vec3 middle) const {
    if (is_on_rim(k)) return -HUGE_VAL;
    double height = -HUGE_VAL;
    for_each_face(k, [&](Vec3 n, Vec3 on) { height = std::max(height, dot(n, middle - on)); });
    return height + kBowMargin * length_;
  }

  /// Columns near one that bows, bow less.
  void spread(std::vector<double>& share) const {
    const double reach = kBowReach * half_thickness_ / length_;
    for (std::int32_t k = 1; k <= last_; ++k)
      share[at(k)] = std::max(share[at(k)], share[at(k - 1)] - (parameter(k) - parameter(k - 1)) / reach);
    for (std::int32_t k = last_ - 1; k >= 0; --k)
      share[at(k)] = std::max(share[at(k)], share[at(k + 1)] - (parameter(k + 1) - parameter(k)) / reach);
  }

  /// Moves middles away from the rim at end e: below the skin beside them, each farther in than the last.
  void clear_rim(std::size_t e, std::vector<Vec3>& middle) const {
    const Vec3 inwards = e == 0 ? along_ : -along_;
    const std::int32_t n = rim_[1 - e] ? last_ / 2 : last_ - 1;
    const Vec3 far = middle[at(e == 0 ? last_ : 0)];
    const double gap = kBowGap * length_;
    double reached = -HUGE_VAL;
    for (std::int32_t i = 1; i <= n; ++i) {
      const std::int32_t k = e == 0 ? i : last_ - i;
      Vec3& m = middle[at(k)];
      double way = reached + gap - dot(m, inwards);
      for_each_face(k, [&](Vec3 normal, Vec3 on) {
        const double slope = -dot(normal, inwards);
        if (slope > kBowSlope) way = std::max(way, (dot(normal, m - on) + kBowMargin * length_) / slope);
      });
      m += std::clamp(way, 0.0, std::max(0.0, dot(far - m, inwards) - gap * (n + 1 - i))) * inwards;
      reached = dot(m, inwards);
    }
  }

  CutContext& cut_;
  CH h_;
  const VisualMesh& mesh_;
  const CollisionMesh& coarse_;
  CutScratch& scratch_;
  std::int32_t last_;
  std::array<bool, 2> rim_{};
  std::array<Vec3, 2> end_;  // of the mid-surface under the wall
  Vec3 along_;
  double length_ = 0, half_thickness_ = 0;
};

}  // namespace

void find_wall_bows(CutContext& cut, CollisionHalfEdge h) {
  cut.scratch.bow.assign(static_cast<std::size_t>(cut.body.collision.chain[h][0].count) + 2, Vec3f{});
  if (cut.options.layers > 1) WallOutline(cut, h).find_bows();
}

}  // namespace kerf::cut
