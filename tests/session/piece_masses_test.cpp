// What pieces weigh: compared with what their drawn surfaces enclose, and with the share of a strip that is cut off.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>
#include <vector>

#include "kerf/cutting/pieces.h"
#include "kerf/session/session.h"
#include "session/session_measures.h"
#include "support/piece_volumes.h"

namespace kerf::piece_masses_test {
namespace {

using test::box_of;
using test::model_session;

/// Upright, along a line at rest.
void cut_line(Session& session, Vec3 from, Vec3 to) {
  const Vec3 up{0, 0, 0.1};
  ASSERT_TRUE(session.begin_stroke(SceneFrame::kRest, true).ok());
  for (int i = 0; i <= 20; ++i) {
    const Vec3 p = lerp(from, to, i / 20.0);
    ASSERT_TRUE(session.move_blade(p + up, p - up).ok());
  }
  ASSERT_TRUE(session.end_stroke().ok());
}

double sum(const std::vector<double>& values) { return std::accumulate(values.begin(), values.end(), 0.0); }

std::vector<double> sorted(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values;
}

TEST(PieceMasses, AStripCutAtAThirdWeighsAThird) {
  Session session = model_session("strip", 0, 3);
  const Box3 box = box_of(session);
  const double whole = 0.2 * 0.024 * 0.003 * session.material().density;  // the model's own measures
  const PieceMasses before = session.piece_masses();
  ASSERT_EQ(before.mass.size(), 1u);
  EXPECT_NEAR(before.mass[0], whole, 1e-6 * whole);
  EXPECT_NEAR(before.uncut, before.mass[0], 1e-12 * whole);

  const double x = box.min.x + box.size().x / 3;
  cut_line(session, {x, box.min.y - 0.01, 0}, {x, box.max.y + 0.01, 0});
  const std::vector<double> after = sorted(session.piece_masses().mass);
  ASSERT_EQ(after.size(), 2u);
  EXPECT_NEAR(after[0], whole / 3, 1e-6 * whole);
  EXPECT_NEAR(after[1], 2 * whole / 3, 1e-6 * whole);
  EXPECT_NEAR(sum(after), before.mass[0], 1e-9 * whole);

  // Twice as dense is twice as heavy; what was taken away still belongs to the uncut body.
  const Material m = session.material();
  ASSERT_TRUE(session.set_material(m.young, m.poisson, 2 * m.density).ok());
  EXPECT_NEAR(session.piece_masses().uncut, 2 * before.uncut, 1e-12 * whole);
  EXPECT_NEAR(sum(session.piece_masses().mass), 2 * before.uncut, 1e-9 * whole);
  ASSERT_TRUE(session.remove_piece(CollisionTriangle(std::size_t{0})).ok());
  ASSERT_EQ(session.piece_masses().mass.size(), 1u);
  EXPECT_NEAR(session.piece_masses().uncut, 2 * before.uncut, 1e-12 * whole);
}

TEST(PieceMasses, PiecesWeighWhatTheirSurfacesEnclose) {
  Session session = model_session("steak", 0, 3);
  const double density = session.material().density, whole = session.piece_masses().uncut;
  for (const auto& [from, to] : std::vector<std::pair<Vec3, Vec3>>{{{-0.15, 0.01, 0}, {0.15, -0.02, 0}},
                                                                   {{-0.03, -0.15, 0}, {0.01, 0.15, 0}},
                                                                   {{0.05, -0.15, 0}, {0.06, 0.15, 0}}}) {
    cut_line(session, from, to);
    const PieceMasses now = session.piece_masses();
    EXPECT_NEAR(sum(now.mass), whole, 1e-9 * whole);
    const std::vector<double> enclosed = testing_support::piece_volumes(session.body().complex),
                              mass = sorted(now.mass);
    ASSERT_EQ(mass.size(), enclosed.size());
    for (std::size_t i = 0; i < mass.size(); ++i) EXPECT_NEAR(mass[i], density * enclosed[i], 0.005 * whole) << i;
    // Each has a living copy of its own.
    std::set<std::int32_t> copies;
    for (const HexId h : now.copy) {
      EXPECT_TRUE(session.body().hex.alive(h));
      copies.insert(h.value);
    }
    EXPECT_EQ(copies.size(), mass.size());
  }
  EXPECT_EQ(session.piece_masses().mass.size(), 6u);
}

}  // namespace
}  // namespace kerf::piece_masses_test
