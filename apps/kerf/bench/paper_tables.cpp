// Section 5 of the paper, measured here beside its values. The paper: Intel i7-4770 3.4 GHz, SOFA.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <span>

#include "bench/bench_bodies.h"
#include "bench/benchmarks.h"
#include "bench/machine.h"
#include "bench/session_timing.h"
#include "kerf/base/parallel.h"

namespace kerf::bench {
namespace {

constexpr double kMilliseconds = 1e3;  // ms per s

/// A row of tables 1, 3 and 5.
struct PaperBinding {
  BenchBody body;
  double seconds, vertices_per_triangle, triangles_per_triangle;
};

/// A model of tables 2, 4 and 6: times per cut in ms under the paper's column names; 0 where it gives none.
struct PaperCut {
  BenchBody body;
  const char* name;
  double cut_and_binding, embedding, surface, total;
  const char* simulation;
};

const PaperBinding kTable1[] = {{{"steak", 0, 67}, 5.1, 105, 137}, {{"steak", 0, 137}, 10.2, 50, 70}};
const PaperBinding kTable3[] = {{{"sheet", 1664, 104}, 0.8, 26, 31},
                                {{"sheet", 6656, 104}, 7.1, 73, 102},
                                {{"sheet", 26624, 104}, 57.5, 214, 337},
                                {{"sheet", 106496, 104}, 422.2, 688, 1193}};
const PaperBinding kTable5[] = {
    {{"sheet", 6656, 104}, 6.9, 73, 102}, {{"sheet", 6656, 500}, 35.1, 25, 29}, {{"sheet", 6656, 1500}, 105.9, 11, 10}};
const PaperBinding kMeniscus[] = {{{"meniscus", 0, 160}, 12.7, 64, 76}};

const PaperCut kTable2[] = {{{"steak", 0, 67}, "1: 67 collision triangles", 2.5, 15.3, 3.7, 17.6, "2.5-3.5"},
                            {{"steak", 0, 137}, "2: 137 collision triangles", 2.4, 5.8, 3.2, 9.4, "2.6-3.8"}};
const PaperCut kTable4[] = {{{"sheet", 1664, 104}, "1: 881 visual vertices", 0.9, 9.1, 0, 10.5, "2.5-3.5"},
                            {{"sheet", 6656, 104}, "2: 3,425 visual vertices", 1.9, 12.3, 0, 14.6, "2.7-3.6"},
                            {{"sheet", 26624, 104}, "3: 13,505 visual vertices", 3.7, 17.9, 0, 21.9, "3.9-5.2"},
                            {{"sheet", 106496, 104}, "4: 53,633 visual vertices", 10.9, 38.6, 0, 49.9, "7.2-8.5"}};

/// What a run of the benchmark shares.
class PaperBench {
 public:
  PaperBench(const BenchOptions& options, const Progress& progress) : options_(options), progress_(progress) {}

  Result<Run> run() {
    const ThreadLimit one(1);
    KERF_TRY(binding("table-1", "Table 1: pre-processing of the steak", kTable1));
    KERF_TRY(cutting("table-2", "Table 2: cutting the steak", kTable2));
    KERF_TRY(six_cuts());
    KERF_TRY(
        binding("table-3", "Table 3: pre-processing of the thin sheet, visual meshes of four resolutions", kTable3));
    KERF_TRY(cutting("table-4", "Table 4: cutting the thin sheet, visual meshes of four resolutions", kTable4));
    KERF_TRY(binding("table-5", "Table 5: pre-processing of the thin sheet, collision meshes of three resolutions",
                     kTable5));
    KERF_TRY(table_6());
    KERF_TRY(meniscus());
    KERF_TRY(haptic_frames());
    KERF_TRY(sofa());
    return std::move(run_);
  }

 private:
  bool wanted(std::string_view id) { return options_.wants(id) && progress_(id, 0).ok(); }
  Status finish(Table table) {
    run_.tables.push_back(std::move(table));
    run_.machine = machine_facts();
    return options_.kept ? options_.kept(run_) : Status{};
  }
  [[nodiscard]] int frames() const { return options_.quick ? 20 : 1000; }

  Status binding(const char* id, const char* title, std::span<const PaperBinding> rows) {
    if (!wanted(id)) return {};
    Table table;
    table.id = id;
    table.title = title;
    table.note =
        "Seconds of one thread, everything but reading files; medians. Visual vertices of a collision triangle are those in it, on its "
        "edges and at its corners. Both sides of a closed body count, after re-meshing. The mean is over all triangles.";
    table.columns = {"#",
                     "collision vertices",
                     "collision triangles",
                     "time, paper (s)",
                     "here, local paths (s)",
                     "here, exact paths (s)",
                     "visual vertices per triangle, paper",
                     "here",
                     "visual triangles per triangle, paper",
                     "here"};
    for (const PaperBinding& row : rows) {
      if (options_.quick && row.body.visual > 7000) continue;
      const auto timing = time_binding(row.body, options_.quick ? 1 : 7, true, true);
      if (!timing) return timing.error();
      table.rows.push_back({static_cast<double>(table.rows.size() + 1), static_cast<double>(timing->collision_vertices),
                            static_cast<double>(timing->collision_triangles), row.seconds, timing->local, timing->exact,
                            row.vertices_per_triangle, std::round(timing->visual_vertices_per_triangle),
                            row.triangles_per_triangle, std::round(timing->visual_triangles_per_triangle)});
    }
    return finish(std::move(table));
  }

  static void add_row(Table& table, const char* model, const char* what, Cell paper, const Sample& sample,
                      double unit = kMilliseconds) {
    std::vector<Cell> row{model, what, std::move(paper)};
    append_quantiles(row, sample, unit);
    table.rows.push_back(std::move(row));
  }

  /// Rows of one model under the paper's columns; frames before any cut, and after six.
  Status cut_rows(Table& table, const PaperCut& paper) {
    auto session = bench_session(paper.body);
    if (!session) return session.error();
    auto frames_before = time_frames(*session, frames());
    if (!frames_before) return frames_before.error();
    const auto timings = time_cuts(*session, options_.cut_count());
    if (!timings) return timings.error();
    const auto value = [](double v) { return v > 0 ? Cell(v) : Cell(); };
    const char* name = paper.name;
    add_row(table, name, "Cut and Update Collision-Visual Binding", value(paper.cut_and_binding),
            timings->cut_and_binding);
    add_row(table, name, "Update Collision-Simulation and Visual-Simulation Embedding", value(paper.embedding),
            timings->embedding);
    if (paper.surface > 0) add_row(table, name, "Add Surface Mesh", paper.surface, timings->surface);
    table.rows.push_back(
        {name, "sum of these parts", value(paper.cut_and_binding + paper.embedding + paper.surface),
         kMilliseconds * (timings->cut_and_binding.median() + timings->embedding.median() + timings->surface.median()),
         Cell(), Cell()});
    add_row(table, name, "Total Cut Time", value(paper.total), timings->whole);
    const auto poses = time_poses(*session, std::max(1, options_.cut_count() / 20), true);
    if (!poses) return poses.error();
    add_row(table, name, "a cut by hand while it moves, per pose", Cell(), *poses);
    add_row(table, name, "Simulation Time, before the cuts", paper.simulation, frames_before->frame);
    if (const auto six = time_short_cuts(*session, 6, session_size(*session), 100); !six) return six.error();
    const auto frames_after = time_frames(*session, frames());
    if (!frames_after) return frames_after.error();
    add_row(table, name, "Simulation Time, after six cuts", paper.simulation, frames_after->frame);
    add_row(table, name, "of it mechanics", Cell(), frames_after->mechanics);
    add_row(table, name, "total cut time per collision triangle", Cell(), timings->per_triangle);
    table.rows.push_back({name, "collision triangles in a cut (mean)", Cell(), timings->triangles, Cell(), Cell()});
    add_row(table, name, "undo of a cut", Cell(), timings->undo);
    return {};
  }
  static double session_size(const Session& session) {
    Box3 box;
    for (const Vec3 p : session.body().complex.collision.rest.raw()) box.add(p);
    return 0.4 * box.diagonal();
  }

  Status cutting(const char* id, const char* title, std::span<const PaperCut> models) {
    if (!wanted(id)) return {};
    Table table;
    table.id = id;
    table.title = title;
    table.note = fmt::format(
        "Milliseconds. {} straight cuts at random from border to border, each undone. A cut of the paper is not longer. Simulation: frames "
        "of {} time steps of 10 ms, with positions and normals of the visual mesh, held at one end under gravity. The paper's parts do not "
        "add up to its totals; both are shown. Totals are times of the thread, parts those of the clock on the wall.",
        options_.cut_count(), frames());
    table.columns = {"#", "", "paper", "median", "99th percentile", "worst"};
    for (const PaperCut& model : models)
      if (!options_.quick || model.body.visual < 7000) KERF_TRY(cut_rows(table, model));
    return finish(std::move(table));
  }

  /// Figures 16 and 17.
  Status six_cuts() {
    if (!wanted("figure-16")) return {};
    auto session = bench_session({"steak", 0, 137});
    if (!session) return session.error();
    Table table;
    table.id = "figure-16";
    table.title = "Figures 16 and 17: the second steak in six consecutive cuts";
    table.note =
        "Vertices and elements of the three meshes, and the median time of a frame. Figure 17 of the paper compares its collision mesh "
        "with those of methods that collide what they draw. These have 2,641 vertices and 5,278 triangles at best.";
    table.columns = {"cuts",  "visual vertices", "visual triangles", "collision vertices", "collision triangles",
                     "nodes", "hexahedra",       "pieces",           "frame (ms)"};
    const double reach = session_size(*session);
    for (int i = 0; i <= 6; ++i) {
      if (i > 0) {
        const auto cut = time_short_cuts(*session, 1, 1.2 * reach, 40 + i);
        if (!cut) return cut.error();
      }
      const auto frames = time_frames(*session, options_.quick ? 10 : 200);
      if (!frames) return frames.error();
      const BodyCounts c = session->counts();
      table.rows.push_back({static_cast<double>(i), static_cast<double>(c.visual_vertices),
                            static_cast<double>(c.visual_triangles), static_cast<double>(c.collision_vertices),
                            static_cast<double>(c.collision_triangles), static_cast<double>(c.nodes),
                            static_cast<double>(c.hexahedra), static_cast<double>(c.pieces),
                            kMilliseconds * frames->frame.median()});
    }
    run_.figures.push_back(plot_of(table, "figure-16a", "vertices", {1, 3, 5}));
    run_.figures.push_back(plot_of(table, "figure-16b", "elements", {2, 4, 6}));
    Figure f17 = plot_of(table, "figure-16-17", "collision vertices and triangles", {3, 4});
    for (const auto& [name, value] :
         {std::pair{"vertices of others, at best", 2641.0}, std::pair{"triangles of others, at best", 5278.0}})
      f17.plot.lines.push_back({name, {{0, value}, {6, value}}, false, ""});
    run_.figures.push_back(std::move(f17));
    return finish(std::move(table));
  }
  static Figure plot_of(const Table& table, const char* id, const char* what, const std::vector<std::size_t>& columns) {
    Figure figure;
    figure.id = id;
    figure.caption = fmt::format("{}, six cuts", what);
    figure.plot.title = figure.caption;
    figure.plot.x_label = "cuts";
    figure.plot.y_label = what;
    figure.plot.log_y = true;
    for (const std::size_t c : columns) {
      app::PlotLine line{table.columns[c], {}, true, ""};
      for (const auto& row : table.rows) line.points.push_back({row[0].number, row[c].number});
      figure.plot.lines.push_back(std::move(line));
    }
    return figure;
  }

  Status table_6() {
    if (!wanted("table-6")) return {};
    struct Model {
      const char* name;
      std::size_t collision;
      const char *cut, *without, *with, *fps_without, *fps_with;
    };
    // The copy of the paper at hand has the first row of this table; its text has two more figures.
    static constexpr Model kModels[] = {{"1: 104 collision triangles", 104, "13.6", "5.1-7.0", "12.0-15.1", "", ""},
                                        {"2: 500", 500, "", "", "", "", "real time"},
                                        {"3: 1,500", 1500, "", "", "", "", "21.7"},
                                        {"4: 6,656, the visual mesh itself", 6656, "", "", "", "", "7.5"}};
    Table table;
    table.id = "table-6";
    table.title = "Table 6: cutting the thin sheet of 6,656 visual triangles, collision meshes of four resolutions";
    table.note = fmt::format(
        "Milliseconds, and frames per second (median, and of the 99th percentile and the worst frame). {} cuts, {} frames of 10 ms, "
        "surface included. With collision, the sheet, cut once, lies on four balls of 672 triangles together. It has 1 kg as in the other "
        "rows, or 20 kg, so heavy that it wraps around them. It touches the balls alone, as in the paper, or itself too. The first two "
        "seconds are left out. The copy of the paper at hand breaks off after the first row of its table; the other figures are from its "
        "text.",
        options_.cut_count(), frames());
    table.columns = {"#", "", "paper", "median", "99th percentile", "worst"};
    for (const Model& model : kModels) {
      if (options_.quick && model.collision > 500) continue;
      auto session = bench_session({"sheet", 6656, model.collision});
      if (!session) return session.error();
      const auto timings = time_cuts(*session, options_.cut_count());
      if (!timings) return timings.error();
      const auto free = time_frames(*session, frames());
      if (!free) return free.error();
      add_row(table, model.name, "Total Cut Time", model.cut, timings->whole);
      add_row(table, model.name, "Simulation without Collision", model.without, free->frame);
      table.rows.push_back({model.name, "Frames per second without collision", model.fps_without,
                            std::round(1 / free->frame.median()), std::round(1 / free->frame.quantile(0.99)),
                            std::round(1 / free->frame.quantile(1))});
      struct Rest {
        double mass;
        bool self;
        const char *name, *fps_name, *paper, *fps_paper;
      };
      for (const Rest& rest :
           {Rest{1, false, "Simulation with Collision", "Frames per second with collision", model.with, model.fps_with},
            Rest{20, false, "the same, 20 kg, wrapped around", "the same, 20 kg, wrapped around", "", ""},
            Rest{20, true, "the same, and with itself", "the same, and with itself", "", ""}}) {
        Scene scene = sheet_over_balls(model.collision, rest.mass);
        scene.contact.self = rest.self;
        auto resting = Session::create(scene);
        if (!resting) return resting.error();
        if (const auto cut = time_short_cuts(*resting, 1, 0.5, 3); !cut) return cut.error();
        KERF_TRY(resting->step(options_.quick ? 20 : 200));
        const auto touching = time_frames(*resting, frames());
        if (!touching) return touching.error();
        add_row(table, model.name, rest.name, rest.paper, touching->frame);
        table.rows.push_back({model.name, rest.fps_name, rest.fps_paper, std::round(1 / touching->frame.median()),
                              std::round(1 / touching->frame.quantile(0.99)),
                              std::round(1 / touching->frame.quantile(1))});
      }
    }
    return finish(std::move(table));
  }

  Status meniscus() {
    KERF_TRY(binding("section-5.3-binding", "Section 5.3: pre-processing of the meniscus", kMeniscus));
    if (!wanted("section-5.3")) return {};
    auto session = bench_session({"meniscus", 0, 160});
    if (!session) return session.error();
    const BodyCounts counts = session->counts();
    Table sizes;
    sizes.id = "section-5.3-sizes";
    sizes.title = "Section 5.3: meshes of the meniscus";
    sizes.columns = {"", "paper", "here"};
    sizes.rows = {{"visual vertices before pre-processing", 2882.0, Cell()},
                  {"visual triangles before pre-processing", 5760.0, Cell()},
                  {"collision vertices", 105.0, static_cast<double>(counts.collision_vertices)},
                  {"collision triangles", 160.0, static_cast<double>(counts.collision_triangles)},
                  {"nodes", 120.0, static_cast<double>(counts.nodes)},
                  {"hexahedra", 42.0, static_cast<double>(counts.hexahedra)}};
    const auto model = make_model("meniscus", {});
    if (!model) return model.error();
    sizes.rows[0][2] = static_cast<double>(model->visual.positions.size());
    sizes.rows[1][2] = static_cast<double>(model->visual.triangles.size());
    KERF_TRY(finish(std::move(sizes)));

    std::vector<Vec3> centres;
    const CollisionMesh& mesh = session->body().complex.collision;
    for (int round = 0; static_cast<int>(centres.size()) < options_.cut_count() && round < 20; ++round)
      for (std::size_t v = 0; v < mesh.vertex_count() && static_cast<int>(centres.size()) < options_.cut_count(); ++v)
        if (mesh.on_rim(CollisionVertex(v))) centres.push_back(mesh.rest[CollisionVertex(v)]);
    const auto timings = time_notches(*session, centres, 0.0035);
    if (!timings) return timings.error();
    const auto frames_free = time_frames(*session, frames());
    if (!frames_free) return frames_free.error();
    Table table;
    table.id = "section-5.3";
    table.title = "Section 5.3: punches out of the meniscus";
    table.note = fmt::format(
        "Milliseconds. {} notches of 7 mm out of the border, cut by a blade that runs around them in twelve poses, each undone. {} frames "
        "of 10 ms with the surface. Seiler et al. 2011 report 86 ms for a punch.",
        timings->whole.values.size(), frames());
    table.columns = {"#", "", "paper", "median", "99th percentile", "worst"};
    const char* name = "meniscus";
    add_row(table, name, "cutting collision and visual mesh and updating collision-visual binding", 6.2,
            timings->cut_and_binding);
    add_row(table, name, "updating visual-simulation and collision-simulation embedding", 32.8, timings->embedding);
    add_row(table, name, "adding the cut surface", 8.1, timings->surface);
    table.rows.push_back(
        {name, "sum of these parts", 6.2 + 32.8 + 8.1,
         kMilliseconds * (timings->cut_and_binding.median() + timings->embedding.median() + timings->surface.median()),
         Cell(), Cell()});
    add_row(table, name, "total cut time of a punch", 48.2, timings->whole);
    add_row(table, name, "simulation step, surface included", 6.5, frames_free->frame);
    table.rows.push_back({name, "frames per second", 162.0, std::round(1 / frames_free->frame.median()),
                          std::round(1 / frames_free->frame.quantile(0.99)),
                          std::round(1 / frames_free->frame.quantile(1))});
    table.rows.push_back({name, "collision triangles in a punch (mean)", Cell(), timings->triangles, Cell(), Cell()});
    return finish(std::move(table));
  }

  /// A frame of everything at 1 kHz, as a haptic device would ask for it.
  Status haptic_frames() {
    if (!wanted("haptic")) return {};
    Table table;
    table.id = "haptic";
    table.title = "Whole frames at 1 kHz: cut by hand, step, contact, surface";
    const int strokes = options_.quick ? 1 : 20, poses = options_.quick ? 60 : 1000;
    table.note = fmt::format(
        "Milliseconds. {} strokes of {} frames of 1 ms across the second steak and the meniscus. Both are held at one end and lie on a "
        "plane, with contact and self-contact. The blade moves in every frame, and every stroke is undone.",
        strokes, poses);
    table.columns = {"body", "", "median", "99th percentile", "99.9th percentile", "worst"};
    for (const char* model : {"steak", "meniscus"}) {
      auto session = Session::create(haptic_scene(model));
      if (!session) return session.error();
      KERF_TRY(session->step(options_.quick ? 20 : 500));
      const auto times = time_cutting_frames(*session, strokes, poses);
      if (!times) return times.error();
      for (const auto& [name, sample] :
           {std::pair{"whole frame", &times->frame}, std::pair{"of it the cut", &times->cut},
            std::pair{"of it the step", &times->step}, std::pair{"of it the surface", &times->surface}})
        table.rows.push_back({model, name, kMilliseconds * sample->quantile(0.5),
                              kMilliseconds * sample->quantile(0.99), kMilliseconds * sample->quantile(0.999),
                              kMilliseconds * sample->quantile(1)});
    }
    return finish(std::move(table));
  }

  /// SOFA is in no package of the systems this project supports; these figures were measured once and are not measured again.
  Status sofa() {
    if (!wanted("sofa")) return {};
    Table table;
    table.id = "sofa";
    table.title = "SOFA, measured once";
    table.note =
        "SOFA of August 2026 built from source with -O3 -march=native, on a two-core virtual machine of the same kind. CPU time of its "
        "process. HexahedronFEMForceField on the sheet of 200 nodes and 81 hexahedra. Its elements bend 36 % too little. Not repeated in "
        "this run.";
    table.columns = {"", "ms per step"};
    table.rows = {{"25 conjugate-gradient iterations", 0.36},
                  {"up to 200 iterations", 2.0},
                  {"25 iterations and a visual mesh of 882 vertices", 0.41},
                  {"3,362 vertices", 0.52},
                  {"13,442 vertices", 0.88},
                  {"55,042 vertices", 2.45},
                  {"falling on four spheres, penalty contact, collision mesh of 98 triangles", 1.4},
                  {"450 triangles", 3.5},
                  {"1,458 triangles", 7.8},
                  {"6,498 triangles", 26.5}};
    return finish(std::move(table));
  }

  const BenchOptions& options_;
  const Progress& progress_;
  Run run_;
};

}  // namespace

Result<Run> bench_paper(const BenchOptions& options, const Progress& progress) {
  return PaperBench(options, progress).run();
}

}  // namespace kerf::bench
