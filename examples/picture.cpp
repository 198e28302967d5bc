// Draws what is cut without a window: the skin from above, with a depth buffer, as picture.ppm.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <vector>

#include "kerf/kerf.h"

namespace {

constexpr int kWidth = 480, kHeight = 400;
constexpr double kMetres = 0.24;  // that the width shows
constexpr double kSkin[] = {190, 60, 60}, kCut[] = {120, 20, 25};

struct Picture {
  std::vector<unsigned char> colour = std::vector<unsigned char>(3 * kWidth * kHeight, 255);
  std::vector<double> height = std::vector<double>(kWidth * kHeight, -HUGE_VAL);

  /// A triangle seen from +z, as bright as it faces the light.
  void draw(const kerf::Vec3 (&p)[3], bool cut) {
    const kerf::Vec3 n = kerf::normalized(kerf::cross(p[1] - p[0], p[2] - p[0]));
    if (!(n.z > 0)) return;
    const double light = 0.25 + 0.75 * std::max(0.0, kerf::dot(n, kerf::normalized(kerf::Vec3{0.3, 0.4, 1})));
    double x[3], y[3];
    for (int k = 0; k < 3; ++k) {
      x[k] = (p[k].x / kMetres + 0.5) * kWidth;
      y[k] = 0.5 * kHeight - p[k].y / kMetres * kWidth;
    }
    const double area = (x[1] - x[0]) * (y[2] - y[0]) - (y[1] - y[0]) * (x[2] - x[0]);
    const auto [left, right] = std::minmax_element(x, x + 3);
    const auto [top, bottom] = std::minmax_element(y, y + 3);
    for (int j = std::max(0, int(*top)); j <= std::min(kHeight - 1., *bottom); ++j)
      for (int i = std::max(0, int(*left)); i <= std::min(kWidth - 1., *right); ++i) {
        const auto edge = [&](int a, int b) { return (x[b] - x[a]) * (j - y[a]) - (y[b] - y[a]) * (i - x[a]); };
        const double w[3] = {edge(1, 2) / area, edge(2, 0) / area, edge(0, 1) / area};
        const double z = w[0] * p[0].z + w[1] * p[1].z + w[2] * p[2].z;
        const auto at = static_cast<std::size_t>(j * kWidth + i);
        if (std::min({w[0], w[1], w[2]}) < 0 || z <= height[at]) continue;
        height[at] = z;
        for (std::size_t c = 0; c < 3; ++c)
          colour[3 * at + c] = static_cast<unsigned char>(light * (cut ? kCut : kSkin)[c]);
      }
  }
};

}  // namespace

int main() {
  kerf::Scene scene;
  scene.body.model = "steak";
  kerf::Result<kerf::Session> session = kerf::Session::create(scene);
  if (!session.ok()) return std::fprintf(stderr, "%s\n", session.error().message.c_str()), 1;
  kerf::Status done = session->begin_stroke(kerf::SceneFrame::kRest, false);
  for (int i = 0; done.ok() && i <= 60; ++i) {  // a clover
    const double a = 2 * std::numbers::pi * i / 60, r = 0.03 + 0.008 * std::sin(3 * a);
    done = session->move_blade({r * std::cos(a), r * std::sin(a), 0.1}, {r * std::cos(a), r * std::sin(a), -0.1});
  }
  if (done.ok()) done = session->end_stroke();
  kerf::SceneRegion hole;  // what has come loose there is taken away
  hole.shape = kerf::SceneRegion::Shape::kSphere;
  hole.radius = 0.02;
  if (const auto taken = session->remove_pieces(hole, kerf::SceneFrame::kRest); !taken.ok()) done = taken.error();
  if (!done.ok()) return std::fprintf(stderr, "%s\n", done.error().message.c_str()), 1;

  Picture picture;
  const kerf::VisualMesh& mesh = session->body().complex.visual;
  const std::vector<kerf::Vec3> place = session->visual_positions();
  for (const kerf::VisualTriangle f : kerf::ids<kerf::VisualTriangle>(mesh.face_count())) {
    kerf::Vec3 p[3];
    for (int k = 0; k < 3; ++k) p[k] = place[mesh.from(kerf::VisualMesh::corner(f, k)).index()];
    picture.draw(p, mesh.patch[f].is_wall());
  }
  std::FILE* file = std::fopen("picture.ppm", "wb");
  if (!file) return std::perror("picture.ppm"), 1;
  std::fprintf(file, "P6 %d %d 255\n", kWidth, kHeight);
  std::fwrite(picture.colour.data(), 1, picture.colour.size(), file);
  return std::fclose(file) == 0 ? 0 : 1;
}
