// Detection of contacts alone: the sheet of the paper's second experiment with its four collision meshes over four fixed
// balls of 12 x 8 quads (672 triangles in one mesh), lying flat on them, wrapped over them, and rolled up. The sheet
// moves a little every step. One thread; prints median and 99th percentile of the thread's time, microseconds.
//
//   contact_detect_bench [steps [text]]    1000 when not given; only rows with this text
#include <fmt/format.h>
#include <time.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <memory>
#include <string>
#include <vector>

#include "kerf/binding/collision_mesh_build.h"
#include "kerf/contact/detect.h"
#include "kerf/mesh/models.h"

namespace {

using namespace kerf;

constexpr double kBall = 0.15, kPlace = 0.25;  // m
constexpr double kPi = 3.14159265358979323846;

double now() {
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}
double percentile(std::vector<double> v, double p) {
  std::sort(v.begin(), v.end());
  return v[static_cast<std::size_t>(p * static_cast<double>(v.size() - 1))];
}

/// Twelve meridians, eight rings of quads, triangles at the poles: 168 triangles.
void add_ball(TriangleMesh& mesh, Vec3 centre) {
  const int sectors = 12, rings = 8;
  const VertexId top = mesh.positions.push_back(centre + Vec3{0, 0, kBall});
  std::vector<VertexId> ids;
  for (int r = 1; r < rings; ++r)
    for (int s = 0; s < sectors; ++s) {
      const double a = kPi * r / rings, b = 2 * kPi * s / sectors;
      ids.push_back(mesh.positions.push_back(
          centre + kBall * Vec3{std::sin(a) * std::cos(b), std::sin(a) * std::sin(b), std::cos(a)}));
    }
  const VertexId bottom = mesh.positions.push_back(centre - Vec3{0, 0, kBall});
  const auto at = [&](int r, int s) { return ids[static_cast<std::size_t>((r - 1) * sectors + s % sectors)]; };
  for (int s = 0; s < sectors; ++s) {
    mesh.triangles.push_back({top, at(1, s), at(1, s + 1)});
    for (int r = 1; r + 1 < rings; ++r) {
      mesh.triangles.push_back({at(r, s), at(r + 1, s), at(r + 1, s + 1)});
      mesh.triangles.push_back({at(r, s), at(r + 1, s + 1), at(r, s + 1)});
    }
    mesh.triangles.push_back({at(rings - 1, s), bottom, at(rings - 1, s + 1)});
  }
}

RigidShape balls(double r) {
  TriangleMesh mesh;
  for (const double x : {-kPlace, kPlace})
    for (const double y : {-kPlace, kPlace}) add_ball(mesh, {x, y, -r - kBall});
  auto prepared = make_obstacle_mesh(mesh);
  if (!prepared) std::abort();
  RigidShape shape;
  shape.parts.push_back(mesh_part(std::make_shared<const ObstacleMesh>(std::move(*prepared))));
  return shape;
}

struct Sheet {
  ContactSurface surface;
  std::vector<Vec3> position, offset, predicted;

  explicit Sheet(std::size_t triangles, double scale = 1) {
    ModelOptions options;
    options.collision_triangles = triangles;
    auto model = make_model("sheet", options);
    for (double& r : model->half_thickness) r *= scale;
    auto mesh = build_collision_mesh(model->collision, model->half_thickness);
    surface = make_contact_surface(*mesh);
    position = surface.rest.raw();
    offset = surface.offset.raw();
    predicted = position;
  }
  template <class Fn>
  void place(Fn&& f) {
    std::vector<Vec3> normal(position.size());
    for (std::size_t v = 0; v < position.size(); ++v) position[v] = f(surface.rest.raw()[v]);
    for (std::size_t t = 0; t < surface.face_count(); ++t) {
      const auto c = surface.vertices(CollisionTriangle(t));
      const Vec3 n =
          cross(position[c[1].index()] - position[c[0].index()], position[c[2].index()] - position[c[0].index()]);
      for (const CollisionVertex v : c) normal[v.index()] += n;
    }
    for (std::size_t v = 0; v < position.size(); ++v) {
      offset[v] = surface.radius.raw()[v] * normalized(normal[v]);
      predicted[v] = position[v] + Vec3{0, 0, -1e-4};
    }
  }
};

Vec3 flat(Vec3 p, double wave) { return p + Vec3{0, 0, wave * std::sin(7 * p.x + 5 * p.y) + 1e-4}; }
/// Over the balls, hanging in between by more than half of the thickness.
Vec3 draped(Vec3 p, double wave) {
  double z = 0;
  for (const double x : {-kPlace, kPlace})
    for (const double y : {-kPlace, kPlace})
      z = std::max(z, std::exp(-((p.x - x) * (p.x - x) + (p.y - y) * (p.y - y)) / (2 * 0.12 * 0.12)));
  return {p.x, p.y, 0.07 * (z - 1) + wave * std::sin(7 * p.x + 5 * p.y)};
}
/// A spiral whose layers all but touch.
Vec3 rolled(Vec3 p, double wave, double r) {
  const double pitch = 2.05 * r / (2 * kPi), inner = 1.5 * r;
  const double length = p.x + 0.5, angle = (-inner + std::sqrt(inner * inner + 2 * pitch * length)) / pitch;
  const double radius = inner + pitch * angle + wave * std::sin(5 * p.y);
  return {radius * std::cos(angle), p.y, radius * std::sin(angle)};
}

struct Times {
  double median = 0, p99 = 0;
  std::size_t contacts = 0;
};

template <class Fn>
Times measure(Sheet& sheet, std::span<const RigidShape> shapes, bool self, int steps, Fn&& shape_at) {
  DetectOptions options;
  options.step = 0.01;
  options.self_contact = self;
  DetectMemory memory;
  DetectWorkspace workspace;
  std::vector<Contact> contacts;
  std::vector<double> times;
  for (int i = 0; i < steps; ++i) {
    shape_at(1e-5 * std::sin(0.1 * i));
    const SurfaceState state{&sheet.surface, sheet.position, sheet.offset, sheet.predicted};
    const double start = now();
    detect(std::span(&state, 1), shapes, {}, options, memory, workspace, contacts);
    times.push_back(now() - start);
  }
  times.erase(times.begin(), times.begin() + std::min<std::ptrdiff_t>(10, steps / 2));
  return {1e6 * percentile(times, 0.5), 1e6 * percentile(times, 0.99), contacts.size()};
}

}  // namespace

int main(int argc, char** argv) {
  const int steps = argc > 1 ? std::max(2, std::atoi(argv[1])) : 1000;
  const std::string only = argc > 2 ? argv[2] : "";
  fmt::print("| {:<26} | {:>16} | {:>16} | {:>16} | {:>16} | {:>8} |\n", "", "boxes", "self", "obstacle", "all",
             "contacts");
  const auto row = [&](const std::string& name, double scale, auto&& place) {
    for (const std::size_t n : {104u, 500u, 1500u, 6656u}) {
      const std::string what = fmt::format("{}, {}", name, n);
      if (what.find(only) == std::string::npos) continue;
      Sheet sheet(n, scale);
      const double r = sheet.surface.largest_radius;
      const std::vector<RigidShape> shapes{balls(r)};
      const auto at = [&](double wave) { sheet.place([&](Vec3 p) { return place(p, wave, r); }); };
      const Times none = measure(sheet, {}, false, steps, at), self = measure(sheet, {}, true, steps, at),
                  shape = measure(sheet, shapes, false, steps, at), all = measure(sheet, shapes, true, steps, at);
      const auto text = [](const Times& t) { return fmt::format("{:.1f} / {:.1f}", t.median, t.p99); };
      fmt::print("| {:<26} | {:>16} | {:>16} | {:>16} | {:>16} | {:>8} |\n", what, text(none), text(self), text(shape),
                 text(all), all.contacts);
      std::fflush(stdout);
    }
  };
  row("flat on balls", 1, [](Vec3 p, double wave, double) { return flat(p, wave); });
  row("draped over balls", 1, [](Vec3 p, double wave, double) { return draped(p, wave); });
  row("rolled, r = 1 cm", 0.2, [](Vec3 p, double wave, double r) { return rolled(p, wave, r); });
}
