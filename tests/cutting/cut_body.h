// A body under test: cut it, check every invariant afterwards, count refused paths.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <span>
#include <vector>

#include "cutting/cut_polyline.h"
#include "kerf/cutting/pieces.h"
#include "kerf/cutting/validate.h"
#include "support/piece_volumes.h"
#include "support/synthetic_complex.h"

namespace kerf::testing_support {

struct CutBody {
  CellComplex body;
  ComplexMeasures start;
  CutOptions options;
  CutScratch scratch;
  int refused = 0;

  CutBody(const TriangleMesh& mesh, SyntheticOptions synthetic = {}) : body(make_synthetic_complex(mesh, synthetic)) {
    start = measure_complex(body);
  }
  static CutBody sheet(int subdivisions = 3, bool closed = false) {
    SyntheticOptions o;
    o.subdivisions = subdivisions;
    o.closed = closed;
    return CutBody(sheet_65_mesh(), o);
  }
  /// Cuts and checks. Paths that are refused are counted.
  PolylineCut cut(const std::vector<Vec3>& points, bool check = true) {
    const PolylineCut done = cut_polyline(body, points, options, scratch);
    refused += done.refused;
    if (check) expect_valid();
    return done;
  }
  void expect_valid() {
    const Status status = validate_complex(body, start);
    EXPECT_TRUE(status.ok()) << (status.ok() ? "" : status.error().message);
  }
  int pieces() { return collision_pieces(body).count; }
  /// Skin area of every visual piece, by piece.
  std::vector<double> piece_areas() {
    const Pieces p = visual_pieces(body);
    std::vector<double> area(static_cast<std::size_t>(p.count), 0.0);
    const VisualMesh& m = body.visual;
    for (std::size_t f = 0; f < m.face_count(); ++f) {
      if (m.patch[VisualTriangle(f)].is_wall()) continue;
      const Vec3 a = m.rest[m.origin[VisualHalfEdge(3 * f)]], b = m.rest[m.origin[VisualHalfEdge(3 * f + 1)]],
                 c = m.rest[m.origin[VisualHalfEdge(3 * f + 2)]];
      area[static_cast<std::size_t>(p.of_face[f])] += 0.5 * norm(cross(b - a, c - a));
    }
    return area;
  }
};

inline std::vector<Vec3> circle_points(Vec3 centre, double radius, int n, double turns = 1) {
  std::vector<Vec3> points;
  for (int i = 0; i <= n; ++i) {
    const double angle = 2 * 3.14159265358979323846 * turns * i / n;
    points.push_back(i == n && turns == 1 ? points[0]
                                          : centre + Vec3{radius * std::cos(angle), radius * std::sin(angle), 0});
  }
  return points;
}

}  // namespace kerf::testing_support
