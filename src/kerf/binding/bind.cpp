#include "kerf/binding/bind.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "kerf/base/at.h"
#include "kerf/base/parallel.h"
#include "kerf/base/stopwatch.h"
#include "kerf/binding/bound_vertices.h"
#include "kerf/binding/collision_mesh_build.h"
#include "kerf/binding/flat_parts.h"
#include "kerf/binding/parametrize.h"
#include "kerf/binding/patches.h"
#include "kerf/binding/path_network.h"
#include "kerf/binding/rim_fit.h"
#include "kerf/binding/skin_search.h"
#include "kerf/binding/split_surface.h"
#include "kerf/binding/squash.h"
#include "kerf/binding/tolerances.h"
#include "kerf/binding/weld.h"
#include "kerf/mesh/half_edge_build.h"
#include "kerf/mesh/lips.h"

namespace kerf {
namespace {

/// Rays and closest points that bind a collision vertex, roughly.
constexpr std::size_t kQueriesPerVertex = 8;

struct Measure {
  double area = 0, volume = 0;
};
/// Area, and volume for closed surfaces; origins are taken at a vertex, so that far bodies keep their digits.
template <class Corner>
Measure measure(std::size_t faces, Vec3 origin, Corner&& corner) {
  // Sums of blocks: adding millions of equal parts one by one would lose digits.
  constexpr std::size_t kBlock = 1024, kBlocks = 32;  // so many at a time
  std::vector<Measure> blocks((faces + kBlock - 1) / kBlock);
  parallel_for(blocks.size(), kBlocks, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      Measure m;
      for (std::size_t f = i * kBlock; f < std::min(faces, (i + 1) * kBlock); ++f) {
        const Vec3 a = corner(f, 0) - origin, b = corner(f, 1) - origin, c = corner(f, 2) - origin;
        m.area += 0.5 * norm(cross(b - a, c - a));
        m.volume += dot(a, cross(b, c)) / 6;
      }
      blocks[i] = m;
    }
  });
  Measure total;
  for (const Measure& m : blocks) {
    total.area += m.area;
    total.volume += m.volume;
  }
  return total;
}

std::size_t count_pieces(const HalfEdgeArrays& mesh) {
  const std::size_t faces = mesh.twin.size() / 3;
  std::vector<std::uint8_t> seen(faces, 0);
  std::vector<std::int32_t> stack;
  std::size_t pieces = 0;
  for (std::size_t f0 = 0; f0 < faces; ++f0) {
    if (seen[f0]) continue;
    ++pieces;
    seen[f0] = 1;
    stack.push_back(static_cast<std::int32_t>(f0));
    while (!stack.empty()) {
      const std::int32_t f = stack.back();
      stack.pop_back();
      for (std::int32_t h = 3 * f; h < 3 * f + 3; ++h) {
        const std::int32_t g = mesh.twin[at(h)];
        if (g < 0 || seen[at(g / 3)]) continue;
        seen[at(g / 3)] = 1;
        stack.push_back(g / 3);
      }
    }
  }
  return pieces;
}

/// Does the collision mesh's normal agree with the open sheet's? Judged at the closest points of its triangles' centres.
bool agrees(const SkinSearch& search, const WeldedSurface& visual, const WeldedSurface& collision) {
  double score = 0;
  for (const auto& t : collision.triangles) {
    const Vec3 a = collision.positions[at(t[0])], b = collision.positions[at(t[1])], c = collision.positions[at(t[2])];
    const Vec3 n = cross(b - a, c - a);
    const auto q = search.closest((1.0 / 3) * (a + b + c), {}, HUGE_VAL);
    if (!q) continue;
    const auto& u = visual.triangles[at(q->face)];
    const Vec3 d = visual.positions[at(u[0])];
    score += dot(n, normalized(cross(visual.positions[at(u[1])] - d, visual.positions[at(u[2])] - d)));
  }
  return score >= 0;
}

void turn_over(WeldedSurface& s) {
  for (auto& t : s.triangles) std::swap(t[1], t[2]);
}

TriangleMesh as_mesh(const WeldedSurface& s) {
  TriangleMesh mesh;
  mesh.positions = IndexedArray<VertexId, Vec3>(s.positions);
  for (const auto& t : s.triangles) mesh.triangles.push_back({VertexId(t[0]), VertexId(t[1]), VertexId(t[2])});
  return mesh;
}

/// For the crossings of all paths, about 2.5 sqrt(faces of a patch) each; growing later would copy everything.
HalfEdgeRoom room_for_paths(std::size_t triangles, std::size_t collision_triangles) {
  const double faces = static_cast<double>(triangles),
               patches = 2 * static_cast<double>(collision_triangles);  // an open sheet has half
  const auto crossings = static_cast<std::size_t>(1.2 * 1.5 * patches * (2.5 * std::sqrt(faces / patches) + 4));
  return {2 * crossings, crossings};
}

/// Metres, of all chains, those of the rim once.
double length_of_paths(const WalledSurface& w, const CollisionMesh& c, const BoundVertices& vertices,
                       const PathNetwork& network) {
  double length = 0;
  for (const CollisionHalfEdge h : ids<CollisionHalfEdge>(c.half_edge_count()))
    for (std::size_t side = 0; side < (c.twin[h].valid() ? 2u : 1u); ++side) {
      const PoolRun run = network.chain[h.index()][side];
      if (!run.exists() || (c.twin[h].valid() && c.twin[h] < h)) continue;
      Vec3 last = w.at(vertices.bound[c.from(h).index()][side]);
      for (std::int32_t i = 0; i <= run.count; ++i) {
        const Vec3 p = w.at(i < run.count ? network.pool[run.at(i).index()] : vertices.bound[c.to(h).index()][side]);
        length += norm(p - last);
        last = p;
      }
    }
  return length;
}

/// How lips were drawn back for binding: what each vertex moved by, and where it lay. Empty: there are none.
struct DrawnBack {
  std::vector<Vec3> by, from;
};

DrawnBack draw_back(WeldedSurface& surface) {
  if (surface.apart == 0) return {};
  DrawnBack back{draw_lips_back(as_mesh(surface)), surface.positions};
  for (std::size_t v = 0; v < back.by.size(); ++v) surface.positions[v] += back.by[v];
  return back;
}

/// Where vertex v, now at p, lies with the lips together. A vertex that binding left alone gets its own bits back, so that twins stay twins:
/// (p + by) - by is not always p.
Vec3 put_back(const DrawnBack& back, std::size_t v, Vec3 by, Vec3 p) {
  return v < back.from.size() && p == back.from[v] + by ? back.from[v] : p - by;
}

/// Puts the lips together again: what was found while they were apart holds for where they lie.
void put_together(SplitSurface& s, const DrawnBack& visual, CollisionMesh& c, const DrawnBack& collision) {
  for (std::size_t v = 0; v < s.drawn_back.size(); ++v) {
    Vec3& p = s.walled.position[v];
    p = put_back(visual, v, s.drawn_back[v], p);
  }
  s.drawn_back = {};
  for (std::size_t v = 0; v < collision.by.size(); ++v) {
    const CollisionVertex id(v);
    c.rest.set(id, put_back(collision, v, collision.by[v], c.rest[id]));
  }
}

/// Moves everything into the cell complex.
void assemble(SplitSurface&& s, CollisionMesh&& collision, const BoundVertices& vertices, const PathNetwork& network,
              PatchMap&& patches, Parametrization&& parameters, bool closed, CellComplex& out) {
  const auto typed = []<class Id>(std::vector<std::int32_t>& raw, Id) {
    std::vector<Id> ids;
    ids.reserve(raw.size());
    for (const std::int32_t i : raw) ids.push_back(Id{i});
    raw = {};
    return ids;
  };
  WalledSurface& w = s.walled;
  VisualMesh& v = out.visual;

  std::vector<std::uint8_t> free(w.wall_vertex.size());
  for (std::size_t i = 0; i < free.size(); ++i) free[i] = w.wall_vertex[i] == 0;
  w.wall_vertex = {};

  // Free vertices by patch, ascending: counting sort.
  const std::size_t patch_count = 2 * collision.face_count();
  std::vector<std::int32_t> first(patch_count + 1, 0);
  for (std::size_t i = 0; i < free.size(); ++i)
    if (free[i]) ++first[at(patches.label[at(w.outgoing[i] / 3)]) + 1];
  for (std::size_t p = 0; p < patch_count; ++p) first[p + 1] += first[p];
  std::vector<VisualVertex> free_pool(at(first.back()));
  {
    std::vector<std::int32_t> cursor(first.begin(), first.end() - 1);
    for (std::size_t i = 0; i < free.size(); ++i)
      if (free[i]) free_pool[at(cursor[at(patches.label[at(w.outgoing[i] / 3)])]++)] = VisualVertex(i);
  }

  v.rest = Journaled<VisualVertex, Vec3>(std::move(w.position));
  v.normal = Journaled<VisualVertex, Vec3f>(std::move(s.normal));
  v.free = Journaled<VisualVertex, std::uint8_t>(std::move(free));
  if (s.texture.empty()) v.texture.grow(w.origin.size());
  else v.texture = Journaled<VisualHalfEdge, Vec2f>(std::move(s.texture));
  v.barrier = Journaled<VisualHalfEdge, std::uint8_t>(std::move(w.wall));
  v.planar = Journaled<VisualHalfEdge, Vec2>(std::move(parameters.planar));
  parallel_for(4, 1, [&](std::size_t begin, std::size_t end) {  // side by side
    for (std::size_t i = begin; i < end; ++i) {
      if (i == 0) v.origin = Journaled<VisualHalfEdge, VisualVertex>(typed(w.origin, VisualVertex{}));
      if (i == 1) v.twin = Journaled<VisualHalfEdge, VisualHalfEdge>(typed(w.twin, VisualHalfEdge{}));
      if (i == 2) v.outgoing = Journaled<VisualVertex, VisualHalfEdge>(typed(w.outgoing, VisualHalfEdge{}));
      if (i == 3) v.patch = Journaled<VisualTriangle, Patch>(typed(patches.label, Patch{}));
    }
  });

  std::vector<VisualVertex> chain_pool;
  chain_pool.reserve(network.pool.size());
  for (const std::int32_t i : network.pool) chain_pool.push_back(VisualVertex(i));
  out.chain_pool = Journaled<PoolIndex, VisualVertex>(std::move(chain_pool));
  out.free_pool = Journaled<PoolIndex, VisualVertex>(std::move(free_pool));

  CollisionMesh& c = out.collision = std::move(collision);
  double edges = 0;
  std::size_t edge_count = 0;
  for (const CollisionHalfEdge h : ids<CollisionHalfEdge>(c.half_edge_count())) {
    c.chain.set(h, network.chain[h.index()]);
    if (c.twin[h].valid() && c.twin[h] < h) continue;
    edges += norm(c.rest[c.to(h)] - c.rest[c.from(h)]);
    ++edge_count;
  }
  out.mean_root_edge = edges / static_cast<double>(edge_count);
  for (const CollisionVertex i : ids<CollisionVertex>(c.vertex_count()))
    c.bound.set(i, {VisualVertex(vertices.bound[i.index()][0]), VisualVertex(vertices.bound[i.index()][1])});
  for (const CollisionTriangle f : ids<CollisionTriangle>(c.face_count())) {
    std::array<PoolRun, 2> runs;
    for (std::size_t side = 0; side < (closed ? 2u : 1u); ++side) {
      const std::size_t p = 2 * f.index() + side;
      runs[side] = {first[p], first[p + 1] - first[p], false};
    }
    c.free.set(f, runs);
  }
  out.closed = closed;
}

/// What a binding is found on.
enum class Shape {
  kSquashed,  ///< closed bodies: the surface pressed onto the mid-surface
  kUpright,   ///< the surface as it stands
};

/// `squash_failed`: set where the paths or patches of a squashed surface are at fault.
Result<BoundBody> bind_as(Shape shape, const TriangleMesh& visual_mesh, const TriangleMesh& collision_mesh,
                          const BindOptions& options, bool& squash_failed) {
  BoundBody body;
  BindReport& report = body.report;
  Stopwatch watch, total;
  const auto tell = [&](std::string_view stage) { return options.progress(stage, 0); };

  KERF_TRY(tell("prepare"));
  auto welded = weld(visual_mesh, "visual mesh", options.merge);
  if (!welded) return welded.error();
  auto welded_collision = weld(collision_mesh, "collision mesh", options.merge);
  if (!welded_collision) return welded_collision.error();
  WeldedSurface& visual = *welded;
  WeldedSurface& collision = *welded_collision;
  const DrawnBack visual_back = draw_back(visual);
  const DrawnBack collision_back = draw_back(collision);
  report.merged_vertices = static_cast<std::int64_t>(visual.merged);
  report.unused_vertices = static_cast<std::int64_t>(visual.unused);
  report.input_vertices = static_cast<std::int64_t>(visual.positions.size());
  report.input_triangles = static_cast<std::int64_t>(visual.triangles.size());
  if (visual.unused > 0)
    report.warnings.push_back(
        fmt::format("visual mesh: {} vertices belong to no triangle and were left out", visual.unused));
  if (collision.merged + collision.unused > 0)
    report.warnings.push_back(
        fmt::format("collision mesh: {} vertices at equal positions were merged and {} unused ones left out; "
                    "collision vertices are numbered anew",
                    collision.merged, collision.unused));
  const auto renumbered = [](const WeldedSurface& s) {
    return s.merged + s.unused > 0 ? " (vertices are numbered as after merging equal positions)" : "";
  };
  const HalfEdgeRoom room = room_for_paths(visual.triangles.size(), collision.triangles.size());
  const std::size_t queries = kQueriesPerVertex * collision.positions.size();
  Result<HalfEdgeArrays> connected = HalfEdgeArrays{};
  std::optional<SkinSearch> search;
  std::vector<Vec3f> visual_normals;
  parallel_for(3, 1, [&](std::size_t begin, std::size_t end) {  // side by side
    for (std::size_t i = begin; i < end; ++i) {
      if (i == 0) connected = build_half_edges(visual.triangles, visual.positions.size(), room);
      if (i == 1) visual_normals = smooth_normals(visual.positions, visual.triangles, room);
      if (i == 2) search.emplace(visual.positions, visual.triangles, queries);
    }
  });
  if (!connected)
    return Error{connected.error().kind, "visual mesh: " + connected.error().message + renumbered(visual)};
  auto connected_collision = build_half_edges(collision.triangles, collision.positions.size());
  if (!connected_collision)
    return Error{connected_collision.error().kind,
                 "collision mesh: " + connected_collision.error().message + renumbered(collision)};
  if (const std::size_t pieces = count_pieces(*connected_collision); pieces != 1)
    return bad_input(
        fmt::format("collision mesh: it consists of {} separate pieces; bind each body on its own", pieces));

  std::size_t border_edges = 0;
  for (const std::int32_t t : connected->twin) border_edges += t < 0;
  const bool closed = border_edges == 0;
  report.closed = closed;
  if (!closed && !(options.thickness > 0 && std::isfinite(options.thickness)))
    return bad_input(fmt::format(
        "the visual mesh is an open sheet ({} border edges): give its thickness in metres, or a closed visual mesh",
        border_edges));

  std::vector<Vec2f> texture;
  if (visual_mesh.has_texture()) {
    texture.reserve(3 * (visual.triangles.size() + room.triangles));
    for (const auto& uv : visual_mesh.texture) texture.insert(texture.end(), uv.begin(), uv.end());
  }
  const auto corner = [&](std::size_t f, std::size_t k) {
    const auto v = at(visual.triangles[f][k]);
    return visual_back.by.empty() ? visual.positions[v] : visual_back.from[v];
  };
  const Measure before = measure(visual.triangles.size(), visual.positions[0], corner);
  report.area_before = before.area;
  if (closed) {
    report.volume_before = std::fabs(before.volume);
    if (before.volume < 0) {
      turn_over(visual);
      for (Vec3f& n : visual_normals) n = {-n.x, -n.y, -n.z};
      for (std::size_t i = 0; i < texture.size(); i += 3) std::swap(texture[i + 1], texture[i + 2]);
      connected = build_half_edges(visual.triangles, visual.positions.size(), room);
      report.flipped_visual = true;
      report.warnings.push_back("visual mesh: its triangles were clockwise seen from outside and were turned over");
    }
  }
  if (!closed && !agrees(*search, visual, collision)) {
    turn_over(collision);
    report.flipped_collision = true;
    report.warnings.push_back(
        "collision mesh: its triangles were turned over, so that its normal agrees with the visual sheet's");
  }
  const std::vector<double> no_thickness(collision.positions.size(), 0);
  const TriangleMesh collision_surface = as_mesh(collision);
  auto built = build_collision_mesh(collision_surface, no_thickness);
  if (!built) return built.error();
  CollisionMesh& c = *built;
  KERF_TRY(check_folds(c, options.at_fault));
  std::vector<Vec3> normals = vertex_normals(collision_surface);

  SplitSurface s = make_split_surface(visual.positions, visual.triangles, std::move(*connected),
                                      std::move(visual_normals), std::move(texture), room);
  s.drawn_back = visual_back.by;
  const std::size_t most_faces = visual.triangles.size() + static_cast<std::size_t>(kMostByHalving) * c.face_count();
  const double edge = mean_edge(c);
  const bool evened = even_flat_parts(s, {kLongSpoke * edge, kLongEdge * edge, most_faces});
  if (split_long_edges(s, kLongEdge * edge, most_faces) || evened) {
    visual.positions = s.walled.position;
    visual.triangles.resize(s.parent.size());
    for (std::size_t f = 0; f < s.parent.size(); ++f)
      visual.triangles[f] = {s.walled.origin[3 * f], s.walled.origin[3 * f + 1], s.walled.origin[3 * f + 2]};
    search.emplace(visual.positions, visual.triangles, queries);
  }
  const Vec3 origin = visual.positions[0];
  report.seconds.prepare = watch.lap();

  KERF_TRY(tell("vertices"));
  auto bound =
      closed ? bind_closed(s, *search, c, normals, options.at_fault) : bind_open(s, *search, c, options.thickness);
  if (!bound) return bound.error();
  even_bound_points(s);
  search.reset();  // large bodies: what is not needed any more goes
  visual = {};
  report.inserted_points = bound->inserted;
  report.snapped_points = bound->snapped;
  report.warnings.insert(report.warnings.end(), bound->warnings.begin(), bound->warnings.end());
  if (closed) {
    auto led = lead_border(c, s, *bound);
    if (!led) return led.error();
    report.led_vertices = *led;
    lean_border_normals(c, s, *bound, normals);
  }
  for (const CollisionVertex v : ids<CollisionVertex>(c.vertex_count()))
    c.offset.set(v, bound->half_thickness[v.index()] * normals[v.index()]);
  report.seconds.vertices = watch.lap();

  KERF_TRY(tell("paths"));
  PathNetworkOptions path_options{options.exact, {}, options.progress, options.at_fault};
  // The rim's paths stay where the rim is: squashed, the chord over the top would be shorter.
  if (closed && shape == Shape::kSquashed)
    path_options.after_rim = [&] { report.crossed_normals = squash(s, c, *bound, normals); };
  auto network = insert_paths(s, c, *bound, closed, path_options);
  squash_failed = !s.upright.empty();  // until the parameters are there
  if (!network) return network.error();
  report.divided_edges = split_dividing_edges(s, c, *bound, *network);
  report.paths = network->paths;
  report.rim_followed = network->rim_followed;
  report.seconds.paths = watch.lap();

  KERF_TRY(tell("patches"));
  Result<PatchMap> patches = PatchMap{};
  std::vector<Vec2> planar;
  parallel_for(2, 1,
               [&](std::size_t begin, std::size_t end) {  // side by side: to touch so much memory first takes as long
                 for (std::size_t i = begin; i < end; ++i) {
                   if (i == 0) patches = find_patches(s, c, *bound, *network, closed, options.at_fault);
                   if (i == 1) planar.resize(s.walled.origin.size());
                 }
               });
  if (!patches) return patches.error();
  report.seconds.patches = watch.lap();

  KERF_TRY(tell("parameters"));
  auto parameters = parametrize(s, c, *bound, *network, *patches, closed, std::move(planar), options.progress);
  if (!parameters) return parameters.error();
  squash_failed = false;
  report.upright_patches = parameters->upright_patches;
  report.uniform_patches = parameters->uniform_patches;
  stand_up(s);
  put_together(s, visual_back, c, collision_back);
  report.seconds.parameters = watch.lap();

  KERF_TRY(tell("assemble"));
  {
    const WalledSurface& w = s.walled;
    const auto split_corner = [&](std::size_t f, std::size_t k) { return w.position[at(w.origin[3 * f + k])]; };
    const Measure m = measure(s.parent.size(), origin, split_corner);
    report.area_after = m.area;
    report.volume_after = closed ? m.volume : 0;
    report.path_length = length_of_paths(w, c, *bound, *network);
  }
  report.visual_vertices = s.vertex_count();
  report.visual_triangles = s.face_count();
  assemble(std::move(s), std::move(c), *bound, *network, std::move(*patches), std::move(*parameters), closed,
           body.complex);
  if (closed) report.displacement = measure_displacement(body.complex);
  if (report.displacement.mean > kMuchDisplaced)
    report.warnings.push_back(fmt::format(
        "the collision mesh fits badly: walls of cuts will be drawn {:.0f} % of its mean edge beside the blade on the mean; "
        "put it half-way through the thickness, out to the rim",
        100 * report.displacement.mean));
  report.seconds.assemble = watch.lap();
  report.seconds.total = total.lap();
  return body;
}

}  // namespace

Result<BoundBody> bind(const TriangleMesh& visual, const TriangleMesh& collision, const BindOptions& options) {
  bool squash_failed = false;
  std::string why = "that was asked for";
  if (options.squash) {
    auto body = bind_as(Shape::kSquashed, visual, collision, options, squash_failed);
    if (body || !squash_failed || body.error().kind != ErrorKind::kFailed) return body;
    why = "the surface cannot be pressed onto the collision mesh: " + body.error().message;
    if (options.at_fault != nullptr) options.at_fault->clear();
  }
  auto body = bind_as(Shape::kUpright, visual, collision, options, squash_failed);
  if (!body || !body->report.closed) return body;
  body->report.upright = true;
  body->report.warnings.push_back(fmt::format(
      "walls near the rim will be drawn up to {:.0f} % of a collision edge beside the blade, as paths and parameters follow the "
      "surface and not the mid-surface ({})",
      100 * body->report.displacement.largest, why));
  return body;
}

}  // namespace kerf
