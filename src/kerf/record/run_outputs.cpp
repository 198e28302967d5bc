#include "kerf/record/run_outputs.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "kerf/base/shown_text.h"
#include "kerf/mesh/mesh_file.h"
#include "kerf/mesh/whole_file.h"
#include "kerf/record/json_value.h"
#include "kerf/record/surface_export.h"
#include "kerf/session/surface_fade.h"

namespace kerf {

std::string body_look(const Scene& scene) {
  const std::string& model = scene.body.model;
  const std::string& file = scene.body.visual.empty() ? scene.body.bound : scene.body.visual;
  for (const char* look : {"steak", "meniscus"})
    if (model == look || std::filesystem::path(file).filename().string().find(look) != std::string::npos) return look;
  return "sheet";
}

VtuMesh hexahedra_vtu(const Session& session) {
  const HexMesh& hex = session.body().hex;
  VtuMesh out;
  std::vector<std::int32_t> point(hex.node_count(), -1);
  VtuField velocity{"velocity", 3, {}}, displacement{"displacement", 3, {}};
  for (const NodeId n : ids<NodeId>(hex.node_count())) {
    if (!hex.active(n)) continue;
    point[n.index()] = static_cast<std::int32_t>(out.points.size());
    const Vec3 p = session.node_positions()[n.index()], v = session.node_velocities()[n.index()], d = p - hex.rest(n);
    out.points.push_back(p);
    velocity.values.insert(velocity.values.end(), {v.x, v.y, v.z});
    displacement.values.insert(displacement.values.end(), {d.x, d.y, d.z});
  }
  VtuField copy{"copy", 1, {}}, fill{"fill", 1, {}}, branch{"branch", 1, {}};
  std::vector<std::array<std::int32_t, 8>> cells;
  for (const HexId h : ids<HexId>(hex.hex_count())) {
    if (!hex.alive(h)) continue;
    std::array<std::int32_t, 8> corners;
    for (std::size_t c = 0; c < 8; ++c) corners[c] = point[hex.nodes[h][c].index()];
    cells.push_back(corners);
    copy.values.push_back(h.value);
    fill.values.push_back(hex.material[h].fill);
    int number = 0;  // of the copies of this cell that come before this one
    for (HexId other = hex.first_copy[hex.cell_id(hex.cell[h])]; other.valid(); other = hex.next_in_cell[other])
      number += hex.alive(other) && other < h ? 1 : 0;
    branch.values.push_back(number);
  }
  add_hexahedra(out, cells);
  out.point_fields = {velocity, displacement};
  out.cell_fields = {copy, fill, branch};
  return out;
}

std::vector<std::string> final_mesh_files(const std::vector<std::string>& which) {
  constexpr std::pair<const char*, const char*> kFiles[] = {{"visual", "visual_rest.obj"},
                                                            {"visual", "visual.obj"},
                                                            {"collision", "collision_rest.obj"},
                                                            {"collision", "collision.obj"},
                                                            {"hexahedra", "hexahedra.vtu"}};
  std::vector<std::string> files;
  for (const auto& [mesh, file] : kFiles)
    if (std::find(which.begin(), which.end(), mesh) != which.end()) files.emplace_back(file);
  return files;
}

std::vector<std::string> result_files(const SceneOutput& output) {
  std::vector<std::string> files = final_mesh_files(output.meshes);
  if (output.animation) files.emplace_back("body.glb");
  if (output.positions) files.emplace_back("positions.pvd");
  if (output.picture) files.emplace_back("picture.png");
  files.emplace_back("steps.svg");
  files.emplace_back("report.json");
  return files;
}

std::vector<std::string> earlier_results(const std::filesystem::path& folder) {
  const auto text = read_whole_file((folder / "report.json").string(), kOtherFile);
  if (!text) return {};
  constexpr std::size_t kDeepest = 64;  // a report has five levels; a value is taken apart as deep as it is nested
  const auto report = parse_json(text->view(), kDeepest);
  if (!report || report->find("kerf_report_version") == nullptr) return {};
  const JsonValue* files = report->find("files");
  if (files == nullptr || files->array() == nullptr) return {};
  SceneOutput everything;
  everything.meshes = {"visual", "collision", "hexahedra"};
  everything.animation = everything.positions = everything.picture = true;
  std::vector<std::string> names;
  for (const std::string& name : result_files(everything))
    if (std::find(files->array()->begin(), files->array()->end(), JsonValue(name)) != files->array()->end())
      names.push_back(name);
  return names;
}

#ifndef KERF_FILES_IN_MEMORY  // else no run leaves results
Status remove_results(const std::filesystem::path& folder, std::vector<std::string> names,
                      const std::vector<std::string>& kept, const std::vector<std::filesystem::path>& inputs) {
  const auto among = [](const std::vector<std::string>& all, const std::string& name) {
    return std::find(all.begin(), all.end(), name) != all.end();
  };
  const bool series = among(names, "positions.pvd");
  std::vector<std::string> frames, unfinished;
  std::error_code code;
  for (auto it = std::filesystem::directory_iterator(folder, code);
       !code && it != std::filesystem::directory_iterator(); it.increment(code)) {
    const std::string file = it->path().filename().string();
    const std::string result(name_of_unfinished(file));
    const bool frame = series && is_series_frame(result.empty() ? file : result, "positions");
    if (!result.empty() && (frame || among(names, result))) unfinished.push_back(result);
    if (result.empty() && frame) frames.push_back(file);
  }
  for (const std::string& name : unfinished) remove_unfinished((folder / name).string());
  names.insert(names.end(), frames.begin(), frames.end());
  for (const std::string& name : names) {
    const std::filesystem::path path = folder / name;
    const bool input = std::any_of(inputs.begin(), inputs.end(),
                                   [&](const auto& in) { return same_file(in.string(), path.string()); });
    if (input || among(kept, name) || !std::filesystem::is_regular_file(std::filesystem::symlink_status(path, code)))
      continue;
    if (!std::filesystem::remove(path, code) && code)
      return bad_input(fmt::format("{}: this result of an earlier run can't be removed ({}); choose another folder",
                                   shown(path.string()), code.message()));
  }
  return {};
}
#endif

Status write_final_meshes(Session& session, const std::vector<std::string>& which,
                          const std::filesystem::path& folder) {
  const auto wanted = [&](const char* name) { return std::find(which.begin(), which.end(), name) != which.end(); };
  const CellComplex& complex = session.body().complex;
  const auto path = [&](const char* name) { return (folder / name).string(); };
  if (wanted("visual")) {
    KERF_TRY(write_obj(path("visual_rest.obj"), visual_surface(complex), surface_group_names()));
    KERF_TRY(write_obj(path("visual.obj"), visual_surface(complex, session.visual_positions()), surface_group_names()));
  }
  if (wanted("collision")) {
    KERF_TRY(write_obj(path("collision_rest.obj"), collision_surface(complex)));
    KERF_TRY(write_obj(path("collision.obj"), collision_surface(complex, session.collision_positions())));
  }
  if (wanted("hexahedra")) KERF_TRY(write_vtu(path("hexahedra.vtu"), hexahedra_vtu(session)));
  return {};
}

Animation::Animation(const Scene& scene) {
  const std::string look = body_look(scene);
  GlbMaterial skin{"skin", {0.55f, 0.66f, 0.78f, 1}, 0, 0.55f, true};
  GlbMaterial cut{"cut", {0.80f, 0.86f, 0.92f, 1}, 0, 0.7f, true};
  if (look == "steak") {
    skin.base_color = {0.33f, 0.07f, 0.05f, 1};
    cut.base_color = {0.52f, 0.09f, 0.08f, 1};
  } else if (look == "meniscus") {
    skin.base_color = {0.78f, 0.73f, 0.62f, 1};
    cut.base_color = {0.86f, 0.80f, 0.72f, 1};
  }
  builder_.add_material(skin);
  builder_.add_material(cut);
}

Status Animation::add_frame(const Session& session) {
  const Body& body = session.body();
  if (version_ != session.topology_version()) {
    surface_ = textured_surface(body.surface, body.complex.visual);
    version_ = session.topology_version();
  }
  session.shown_nodes(nodes_);
  evaluate_render_surface(body.surface, body.complex.visual, body.hex, body.embedding, nodes_, positions_, normals_);
  if (const auto fades = session.fading_visual(); !fades.empty())
    for (std::size_t i = 0; i < positions_.size(); ++i)
      if (const FadingVertex* f = fading(fades, body.surface.vertex[RenderVertex(i)].index()))
        positions_[i] = to_float(to_double(positions_[i]) + f->offset);
  frame_positions_.clear();
  frame_normals_.clear();
  for (const RenderVertex v : surface_.vertex) {
    frame_positions_.push_back(positions_[v.index()]);
    frame_normals_.push_back(normals_[v.index()]);
  }
  const GlbPrimitive primitives[2] = {{0, surface_.skin}, {1, surface_.walls}};
  GlbFrame frame;
  frame.seconds = session.time();
  frame.positions = frame_positions_;
  frame.normals = frame_normals_;
  frame.texture = surface_.texture;
  frame.primitives = primitives;
  return builder_.add_frame(frame);
}

}  // namespace kerf
