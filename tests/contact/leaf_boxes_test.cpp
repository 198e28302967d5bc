// What eight boxes at a time leave out is what one box at a time does; edges that they leave out have no inner feet by exact arithmetic.
#include "kerf/contact/leaf_boxes.h"

#include <gtest/gtest.h>

#include <cfloat>
#include <cmath>

#include "kerf/base/random.h"
#include "kerf/contact/detect_scratch.h"
#include "kerf/spatial/segment_queries.h"

namespace kerf::leaf_boxes_test {
namespace {

Vec3 random_vec(Random& random, double size) {
  return {random.uniform(-size, size), random.uniform(-size, size), random.uniform(-size, size)};
}
TreeBox box_of(Vec3 a, Vec3 b) { return joined({to_corner(a), to_corner(a)}, {to_corner(b), to_corner(b)}); }
TreeBox random_directions(Random& random, float length) {
  const Vec3 n = normalized(random_vec(random, 1));
  TreeBox d = box_of(normalized(n + random_vec(random, 0.3)), normalized(n + random_vec(random, 0.3)));
  d.min.x[3] = 0.5f * length;
  d.max.x[3] = length;
  return d;
}

/// A leaf of `count` boxes, node 0.
LeafBoxes random_boxes(Random& random, int count, std::vector<TreeBox>& boxes) {
  LeafBoxes list;
  list.clear(1);
  list.list(0, [&](auto&& add) {
    for (int i = 0; i < count; ++i) {
      const Vec3 at = random_vec(random, 1);
      boxes.push_back(box_of(at, at + random_vec(random, 0.4)));
      add(i, boxes.back());
    }
  });
  return list;
}

TEST(LeafBoxes, LeaveOutWhatOneBoxAtATimeDoes) {
  Random random(5);
  std::size_t out = 0, in = 0;
  for (int round = 0; round < 2000; ++round) {
    std::vector<TreeBox> boxes;
    const int count = static_cast<int>(random.uniform(0, 20));
    const LeafBoxes list = random_boxes(random, count, boxes);
    ASSERT_EQ(list.block.size(), static_cast<std::size_t>(count + 7) / 8);
    const Vec3 at = random_vec(random, 1);
    const TreeBox probe = box_of(at, round % 2 == 0 ? at : at + random_vec(random, 0.3));
    const TreeBox mine = random_directions(random, 0.2f), others = random_directions(random, 0.3f);
    const auto reach = static_cast<float>(random.uniform(0, 0.8)), limit = static_cast<float>(random.uniform(0, 0.3));
    std::vector<int> close(boxes.size()), point(boxes.size()), facing(boxes.size());
    list.for_each(
        0, [&](std::uint32_t b) { return near_box(list.block[b], probe, reach); },
        [&](std::uint32_t i) { ++close.at(i); });
    list.for_each(
        0, [&](std::uint32_t b) { return near_point(list.block[b], probe.min, reach * reach); },
        [&](std::uint32_t i) { ++point.at(i); });
    list.for_each(
        0,
        [&](std::uint32_t b) {
          return near_box(list.block[b], probe, 2) & not_side_by_side(probe, mine, list.block[b], others, limit);
        },
        [&](std::uint32_t i) { ++facing.at(i); });
    for (std::size_t i = 0; i < boxes.size(); ++i) {
      ASSERT_EQ(list.item[i], static_cast<std::int32_t>(i));
      ASSERT_EQ(close[i], near(boxes[i], probe, reach) ? 1 : 0);
      ASSERT_EQ(point[i], squared_distance(boxes[i], probe.min) > reach * reach ? 0 : 1);
      const bool beside = side_by_side(probe, mine, boxes[i], others, limit);
      ASSERT_EQ(facing[i], !beside && near(boxes[i], probe, 2) ? 1 : 0);
      ++(beside ? out : in);
    }
  }
  EXPECT_GT(out, 500u);
  EXPECT_GT(in, 500u);
}

TEST(LeafBoxes, NothingIsFoundInPlacesThatAreNotInUse) {
  Random random(6);
  for (int count = 0; count < 20; ++count) {
    std::vector<TreeBox> boxes;
    const LeafBoxes list = random_boxes(random, count, boxes);
    std::vector<int> found(boxes.size());
    list.for_each(
        0,
        [&](std::uint32_t b) {
          return near_point(list.block[b], {}, HUGE_VALF) & near_box(list.block[b], {}, HUGE_VALF);
        },
        [&](std::uint32_t i) { ++found.at(i); });
    for (const int times : found) EXPECT_EQ(times, 1);
  }
}

/// A leaf may only be left out if everything in it is: also where the leaf holds a single thing, and rounding decides.
TEST(LeafBoxes, LeavesEightAtATimeKeepAllThatIsSelectedInThem) {
  Random random(7);
  std::size_t selected = 0, out = 0, in = 0;
  for (int round = 0; round < 4000; ++round) {
    const Vec3 centre = random_vec(random, round % 4 == 0 ? 20 : 0.5);
    const Vec3 at = centre + random_vec(random, 1);
    const TreeBox probe = box_of(at, round % 2 == 0 ? at : at + random_vec(random, 0.3));
    const TreeBox mine = round % 3 == 0 ? random_directions(random, 0) : random_directions(random, 0.2f);
    const auto reach = static_cast<float>(random.uniform(0, 1)),
               limit = round % 5 == 0 ? 0.0f : static_cast<float>(random.uniform(0, 0.3));
    const int count = 1 + static_cast<int>(random.uniform(0, 7.99));
    LeafBlock block = no_leaves();
    std::vector<std::vector<TreeBox>> items(static_cast<std::size_t>(count));
    std::vector<TreeBox> directions;
    for (std::size_t k = 0; k < items.size(); ++k) {
      TreeBox leaf;
      const Vec3 middle = centre + random_vec(random, 1);
      const int things = round % 2 == 0 ? 1 : 5;
      for (int i = 0; i < things; ++i) {
        const Vec3 p = middle + random_vec(random, 0.3);
        items[k].push_back(box_of(p, p + random_vec(random, 0.2)));
        leaf = i == 0 ? items[k].back() : joined(leaf, items[k].back());
      }
      directions.push_back(random_directions(random, 0.3f));
      set_leaf(leaf, directions.back(), k, block);
    }
    const TreeCorner p = probe.min, direction = mine.max;
    const unsigned by_point = leaves_near_point(block, p, direction, reach * reach, limit),
                   by_box = leaves_near_box(block, probe, mine, reach, limit);
    EXPECT_EQ((by_point | by_box) >> count, 0u);
    for (std::size_t k = 0; k < items.size(); ++k) {
      ++((by_box >> k & 1) != 0 ? in : out);
      for (const TreeBox& item : items[k]) {
        const bool beside_point = side_by_side({p, p}, {direction, direction}, item, directions[k], limit);
        const bool beside_box = side_by_side(probe, mine, item, directions[k], limit);
        if (!(squared_distance(item, p) > reach * reach) && !beside_point) {
          ASSERT_TRUE((by_point >> k & 1) != 0) << round;
        }
        if (near(item, probe, reach) && !beside_box) {
          ++selected;
          ASSERT_TRUE((by_box >> k & 1) != 0) << round;
        }
      }
    }
  }
  EXPECT_GT(selected, 1000u);
  EXPECT_GT(out, 1000u);
  EXPECT_GT(in, 1000u);
}

TEST(LeafBoxes, KeepEveryEdgeThatHasInnerFeet) {
  Random random(6);
  std::size_t kept = 0, with_feet = 0, all = 0;
  for (int round = 0; round < 20000; ++round) {
    // Far from the origin now and then, and nearly parallel or touching at an end: where rounding counts.
    const Vec3 centre = random_vec(random, round % 3 == 0 ? 30 : 0.3);
    const double size = std::pow(10, random.uniform(-3, 0));
    const Vec3 p = centre + random_vec(random, size), q = p + random_vec(random, size);
    std::vector<std::array<Vec3, 2>> edges;
    double largest = 0;
    for (int i = 0; i < 8; ++i) {
      Vec3 a = centre + random_vec(random, size), b = a + random_vec(random, size);
      if (i == 1) b = a + (q - p) + 1e-4 * size * random_vec(random, 1);
      if (i == 2) a = lerp(p, q, 1e-3) + 1e-9 * random_vec(random, size);
      if (i == 3) a = q, b = p;
      if (i == 4) b = a;
      edges.push_back({a, b});
      for (const Vec3 x : {a, b, p, q}) largest = std::max({largest, std::fabs(x.x), std::fabs(x.y), std::fabs(x.z)});
    }
    LeafEdges list;
    list.clear(1);
    list.list(0, [&](auto&& add) {
      for (int i = 0; i < 8; ++i) {
        const auto& [a, b] = edges[static_cast<std::size_t>(i)];
        add(i, box_of(a, b));
        list.set_last(to_corner(a), to_corner(b), i, i + 1, i % 3 == 0, 0);
      }
    });
    EXPECT_EQ(list.ends[0].rims, 0b01001001u);
    const SegmentProbe probe{to_corner(p), to_corner(q), -1, -1, static_cast<float>(8 * double{FLT_EPSILON} * largest)};
    const unsigned bits = may_have_inner_feet(list.ends[0], probe);
    for (int i = 0; i < 8; ++i) {
      SegmentFeet feet;
      const bool has = inner_feet(p, q, edges[static_cast<std::size_t>(i)][0], edges[static_cast<std::size_t>(i)][1],
                                  feet),
                 keeps = (bits >> i & 1) != 0;
      ASSERT_TRUE(keeps || !has) << round << " " << i;
      if (round % 3 == 0 || size < 0.03 || i < 5) continue;
      ++all, kept += keeps ? 1 : 0, with_feet += has ? 1 : 0;
    }
    SegmentProbe end = probe;
    end.from = 5;
    EXPECT_EQ(may_have_inner_feet(list.ends[0], end) & 0b00110000u, 0u);  // edges 4 (from 4 to 5) and 5 (from 5 to 6)
    EXPECT_EQ(may_have_inner_feet(list.ends[0], end) | 0b00110000u, bits | 0b00110000u);
  }
  // And where rounding is small hardly any other.
  EXPECT_GT(with_feet, all / 50);
  EXPECT_LT(static_cast<double>(kept), 1.1 * static_cast<double>(with_feet)) << all;
}

}  // namespace
}  // namespace kerf::leaf_boxes_test
