#include "bench/random_strokes.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <numbers>
#include <optional>

#include "bench/bench_bodies.h"
#include "bench/timing.h"
#include "kerf/base/random.h"
#include "kerf/cutting/crossings.h"
#include "kerf/cutting/swept_deviation.h"

namespace kerf::bench {
namespace {

constexpr int kMostPieces = 25;  ///< then the next body is taken
constexpr int kUndoEvery = 10;   ///< strokes
constexpr int kWallsEvery = 10;  ///< strokes; walls stay, so a later look sees them too
constexpr double kStep = 0.2;    ///< mean edges between places of walls and of what was swept

struct Surface {
  std::size_t open_edges = 0;
  double volume = 0;  ///< m3
};

/// Of the whole visual mesh at rest, from nothing but corners and positions. An edge is closed where as many faces run along it one way as the other.
Surface measure(const Session& session) {
  const VisualMesh& mesh = session.body().complex.visual;
  Surface surface;
  std::vector<std::uint64_t> there, back;
  const Vec3 origin = mesh.rest[VisualVertex(0)];
  for (std::size_t f = 0; f < mesh.face_count(); ++f) {
    Vec3 p[3];
    std::uint32_t v[3];
    for (int k = 0; k < 3; ++k) {
      const VisualVertex at = mesh.origin[VisualMesh::corner(VisualTriangle(f), k)];
      v[k] = static_cast<std::uint32_t>(at.value);
      p[k] = mesh.rest[at] - origin;
    }
    for (int k = 0; k < 3; ++k) {
      const std::uint64_t a = v[k], b = v[(k + 1) % 3];
      there.push_back(a << 32 | b);
      back.push_back(b << 32 | a);
    }
    surface.volume += dot(p[0], cross(p[1], p[2])) / 6;
  }
  std::sort(there.begin(), there.end());
  std::sort(back.begin(), back.end());
  std::vector<std::uint64_t> open;
  std::set_symmetric_difference(there.begin(), there.end(), back.begin(), back.end(), std::back_inserter(open));
  surface.open_edges = open.size() / 2;
  return surface;
}

/// A line, a curve, or a loop a little more than closed; the blade upright or tilted.
struct Stroke {
  std::vector<Vec3> path;
  Vec3 up;
};
Stroke random_stroke(const Box3& box, Random& random) {
  const auto within = [&] {
    const Vec3 s = box.size();
    return box.center() +
           Vec3{s.x * random.uniform(-0.6, 0.6), s.y * random.uniform(-0.6, 0.6), s.z * random.uniform(-0.6, 0.6)};
  };
  Stroke stroke;
  stroke.up = {random.uniform(-0.5, 0.5), random.uniform(-0.5, 0.5), 1};
  if (random.index(2)) stroke.up = {0, 0, 1};
  stroke.up = 2 * box.diagonal() * normalized(stroke.up);
  const Vec3 a = within(), b = within(), c = within();
  const auto kind = random.index(3);
  if (kind == 0) return {{a, b}, stroke.up};
  const double radius = box.diagonal() * random.uniform(0.03, 0.2);
  for (int i = 0; i <= 12; ++i) {
    const double s = i / 12.0, angle = 2.2 * std::numbers::pi * s;
    stroke.path.push_back(kind == 1 ? lerp(lerp(a, b, s), lerp(b, c, s), s)
                                    : a + radius * Vec3{std::cos(angle), std::sin(angle), 0});
  }
  return stroke;
}

Status draw(Session& session, const Stroke& stroke, Sample& per_triangle, Sample& whole) {
  KERF_TRY(session.begin_stroke(SceneFrame::kRest, false));
  const double start = thread_seconds();
  for (const Vec3 p : stroke.path) KERF_TRY(session.move_blade(p + stroke.up, p - stroke.up));
  const double time = thread_seconds() - start;
  const int triangles = session.strokes().back().triangles;
  KERF_TRY(session.end_stroke());
  if (triangles > 0) {
    per_triangle.add(time / triangles);
    whole.add(time);
  }
  return {};
}

struct Model {
  const char* name;
  std::size_t visual;      ///< triangles; 0: the model's own
  bool in_layers = false;  ///< a long blade meets it more than once
};

/// Adds what a stroke's blade goes over, in the body at rest.
void add_swept(const Stroke& stroke, TriangleSoup& swept) {
  for (std::size_t i = 0; i + 1 < stroke.path.size(); ++i) {
    const Vec3 a = stroke.path[i], b = stroke.path[i + 1], up = stroke.up;
    swept.add(a + up, a - up, b - up);
    swept.add(a + up, b - up, b + up);
  }
}

Result<std::vector<Cell>> row_of(const Model& model, int strokes) {
  Scene scene = bench_scene({model.name, model.visual});
  scene.fixes.clear();  // no time passes
  scene.cut.dust = 0;   // all of the volume stays
  Random random(20);
  Sample per_triangle, whole;
  int done = 0, bodies = 0, errors = 0, broken = 0, undone = 0, wrong_undos = 0, refused = 0, retried = 0,
      triangles = 0;
  std::size_t open = 0;
  double volume_error = 0, stray = 0, missed = 0, outside = 0, through = 0;  // the last four in mean edges
  std::optional<Session> session;
  Surface start;
  TriangleSoup skin, swept;  // of the body uncut; of all its strokes
  const auto look_at_walls = [&] {
    if (!session || swept.size() == 0) return;
    const double edge = session->body().complex.mean_root_edge;
    const TriangleSoup walls = walls_of(session->body().complex);
    swept.build();
    stray = std::max(stray, stray_of(walls, swept, kStep * edge).distance / edge);
    outside = std::max(outside, outside_of(walls, skin, kStep * edge).distance / edge);
    through = std::max(through, crossings_of(session->body().complex).deepest / edge);
  };
  for (int tried = 0; done < strokes && tried < 20 * strokes; ++tried) {
    if (!session || session->counts().pieces > kMostPieces) {
      look_at_walls();
      auto made = Session::create(scene);
      if (!made) return made.error();
      session.emplace(std::move(*made));
      start = measure(*session);
      skin = skin_of(session->body().complex);
      swept = {};
      ++bodies;
    }
    Box3 box;
    for (const Vec3 p : session->body().complex.collision.rest.raw()) box.add(p);
    const std::uint64_t before = body_hash(session->body());
    const int depth = session->undo_depth();
    const Stroke stroke = random_stroke(box, random);
    if (!draw(*session, stroke, per_triangle, whole)) {
      ++errors;
      session.reset();
      continue;
    }
    if (session->undo_depth() == depth) continue;  // met nothing
    ++done;
    const StrokeRecord& record = session->strokes().back();
    triangles += record.triangles;
    refused += record.refused;
    retried += record.retried;
    if (!session->validate()) ++broken;
    const Surface now = measure(*session);
    open = std::max(open, now.open_edges);
    volume_error = std::max(volume_error, std::abs(now.volume - start.volume) / start.volume);
    add_swept(stroke, swept);
    if (!model.in_layers) {
      TriangleSoup last;
      add_swept(stroke, last);
      last.build();
      const double edge = session->body().complex.mean_root_edge;
      missed = std::max(missed, missed_of(last, walls_of(session->body().complex), skin, kStep * edge).distance / edge);
    }
    if (done % kWallsEvery == 0) look_at_walls();
    if (done % kUndoEvery != 0) continue;
    ++undone;
    const std::uint64_t after = body_hash(session->body());
    if (!session->undo() || body_hash(session->body()) != before || !session->redo() ||
        body_hash(session->body()) != after)
      ++wrong_undos;
  }
  look_at_walls();
  return std::vector<Cell>{model.name,
                           static_cast<double>(done),
                           static_cast<double>(triangles),
                           static_cast<double>(bodies),
                           static_cast<double>(errors),
                           static_cast<double>(broken),
                           static_cast<double>(open),
                           fmt::format("{:.1e}", volume_error),
                           fmt::format("{:.1e}", outside),
                           fmt::format("{:.1e}", through),
                           fmt::format("{:.3f}", stray),
                           model.in_layers ? std::string("-") : fmt::format("{:.3f}", missed),
                           fmt::format("{} of {}", wrong_undos, undone),
                           static_cast<double>(refused),
                           static_cast<double>(retried),
                           1e6 * per_triangle.median(),
                           1e6 * per_triangle.quantile(0.99),
                           1e3 * whole.median(),
                           1e3 * whole.quantile(0.99)};
}

}  // namespace

Result<Table> random_strokes(const BenchOptions& options, const Progress& progress) {
  Table table;
  table.id = "random";
  table.title = "Random strokes in closed bodies";
  const int strokes = options.quick ? 5 : 10 * options.cuts;
  table.note = fmt::format(
      "{} strokes that cut in each: lines, curves, loops, upright and tilted, one after the other in a body. Beyond {} pieces a new body "
      "takes its place. Checked after each: all invariants, and edges of the drawn surface without a partner. Its volume is compared "
      "with that of the uncut body, counted from its corners and positions alone. Of what its blade has swept inside the body: the farthest "
      "place from a wall or the skin. A blade that meets several layers and cuts the first is left out there. Looked at after every {}th "
      "and the last of a body: how deep the drawn surface passes through itself; of all walls, the farthest place outside the body, and "
      "from what blades have swept. Every {}th is undone and made again, to the same bits or counted as wrong. One thread, its own time.",
      strokes, kMostPieces, kWallsEvery, kUndoEvery);
  table.columns = {"body",
                   "strokes",
                   "collision triangles cut",
                   "bodies",
                   "errors",
                   "broken invariants",
                   "open edges, worst",
                   "volume error, worst",
                   "wall outside the body, farthest (edges)",
                   "surface through itself, deepest (edges)",
                   "wall from the swept surface, farthest (edges)",
                   "swept place from a wall, farthest (edges)",
                   "wrong undos",
                   "refused steps",
                   "steps retried",
                   "cut per triangle, median (us)",
                   "99th percentile (us)",
                   "whole stroke, median (ms)",
                   "99th percentile (ms)"};
  for (const Model& model : {Model{"steak", 0},
                             {"meniscus", 0},
                             {"closed-sheet", 5000},
                             {"tube", 5000, true},
                             {"holed-slab", 5000},
                             {"two-holed-slab", 5000},
                             {"half-shell", 5000, true},
                             {"s-shape", 5000, true}}) {
    KERF_TRY(progress(fmt::format("random: {}", model.name), 0));
    auto row = row_of(model, strokes);
    if (!row) return row.error();
    table.rows.push_back(std::move(*row));
  }
  return table;
}

}  // namespace kerf::bench
