#include "kerf/binding/dissection.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "kerf/base/random.h"

namespace kerf::dissection_test {
namespace {

struct Graph {
  std::vector<std::int32_t> first{0}, column;
  std::vector<Vec3> points;
};

/// Points in a box, each joined to those nearer than `reach`.
Graph near_points(std::size_t n, double reach, Vec3 place, Vec3 size, std::uint64_t seed) {
  Random random(seed);
  Graph g;
  for (std::size_t i = 0; i < n; ++i)
    g.points.push_back(
        place + Vec3{size.x * random.uniform(0, 1), size.y * random.uniform(0, 1), size.z * random.uniform(0, 1)});
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = 0; j < n; ++j)
      if (i != j && norm(g.points[i] - g.points[j]) < reach) g.column.push_back(static_cast<std::int32_t>(j));
    g.first.push_back(static_cast<std::int32_t>(g.column.size()));
  }
  return g;
}

/// Every row once, children before parents, and no neighbours across two children.
void expect_valid(const Graph& g, const Dissection& d, std::size_t most) {
  std::vector<std::int32_t> rows = d.order();
  std::sort(rows.begin(), rows.end());
  ASSERT_EQ(rows.size(), g.points.size());
  for (std::size_t i = 0; i < rows.size(); ++i) ASSERT_EQ(rows[i], static_cast<std::int32_t>(i));

  std::vector<std::int32_t> node_of(rows.size(), -1), parent(d.nodes().size(), -1);
  std::int32_t next = 0;
  for (std::size_t k = 0; k < d.nodes().size(); ++k) {
    const Dissection::Node& node = d.nodes()[k];
    ASSERT_EQ(node.begin, next);  // children end where their parent begins
    next = node.end;
    if (node.children[0] < 0) {
      EXPECT_LE(node.end - node.begin, static_cast<std::int32_t>(most));
    }
    for (std::int32_t side = 0; side < 2; ++side) {
      const std::int32_t child = node.children[side];
      if (child < 0) continue;
      ASSERT_LT(child, static_cast<std::int32_t>(k));
      parent[static_cast<std::size_t>(child)] = static_cast<std::int32_t>(k);
      EXPECT_EQ(d.nodes()[static_cast<std::size_t>(child)].depth, node.depth + 1);
      EXPECT_EQ(d.nodes()[static_cast<std::size_t>(child)].side, side);
    }
    for (std::int32_t i = node.begin; i < node.end; ++i)
      node_of[static_cast<std::size_t>(d.order()[static_cast<std::size_t>(i)])] = static_cast<std::int32_t>(k);
  }
  const auto above = [&](std::int32_t low, std::int32_t high) {
    while (low >= 0 && low != high) low = parent[static_cast<std::size_t>(low)];
    return low == high;
  };
  for (std::size_t i = 0; i < rows.size(); ++i)
    for (std::int32_t k = g.first[i]; k < g.first[i + 1]; ++k) {
      const std::int32_t a = node_of[i], b = node_of[static_cast<std::size_t>(g.column[static_cast<std::size_t>(k)])];
      ASSERT_TRUE(above(a, b) || above(b, a)) << i;
    }
}

TEST(Dissection, SeparatesHalves) {
  Dissection d;
  for (const auto& [place, size] :
       {std::pair{Vec3{}, Vec3{1, 1, 0.1}}, {Vec3{1e6, -1e6, 0}, {1, 0.01, 1}}, {Vec3{1, 1, 1}, {1e-8, 1e-8, 1e-8}}})
    for (const std::size_t n : {1u, 2u, 13u, 300u, 900u}) {
      const Graph g = near_points(n, 0.12 * std::max({size.x, size.y, size.z}), place, size, 7 + n);
      for (const std::size_t most : {1u, 12u}) {
        d.run({g.first, g.column}, g.points, most);
        expect_valid(g, d, most);
      }
    }
}

TEST(Dissection, TakesPointsThatSayNothing) {
  Graph g = near_points(200, 0.2, {}, {1, 1, 0}, 5);
  const std::vector<Vec3> good = g.points;
  Dissection d;
  for (std::size_t i = 0; i < g.points.size(); ++i) g.points[i] = {3, 3, 3};
  d.run({g.first, g.column}, g.points, 12);
  expect_valid(g, d, 12);
  for (std::size_t i = 0; i < g.points.size(); ++i) g.points[i] = good[(i * 37) % 200];  // far from their neighbours
  d.run({g.first, g.column}, g.points, 12);
  expect_valid(g, d, 12);
}

TEST(Dissection, KeepsSeparatorsSmallOnSheets) {
  const Graph g = near_points(2000, 0.04, {}, {1, 1, 0}, 9);
  Dissection d;
  d.run({g.first, g.column}, g.points, 12);
  expect_valid(g, d, 12);
  const Dissection::Node& root = d.nodes().back();
  EXPECT_LT(root.end - root.begin, 120);  // a strip as wide as the longest link holds 80
  for (const std::int32_t child : root.children) ASSERT_GE(child, 0);
}

}  // namespace
}  // namespace kerf::dissection_test
