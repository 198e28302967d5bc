// Doing what a recording says.
#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "kerf/mesh/whole_file.h"
#include "kerf/record/recording.h"
#include "kerf/record/recording_meshes.h"
#include "kerf/scene/scene_file.h"
#include "kerf/scene/temporary_folder.h"
#include "kerf/scene/time_step_fault.h"

namespace kerf {
namespace {

using Kind = SessionChange::Kind;

Vec3 vec(const std::vector<double>& values, std::size_t at) { return {values[at], values[at + 1], values[at + 2]}; }

SceneRegion region_of(const std::vector<double>& v) {
  SceneRegion r;
  if (v[0] == 0) {
    r.shape = SceneRegion::Shape::kBox;
    r.min = vec(v, 1);
    r.max = vec(v, 4);
  } else if (v[0] == 1) {
    r.shape = SceneRegion::Shape::kSphere;
    r.center = vec(v, 1);
    r.radius = v[4];
  } else {
    r.shape = SceneRegion::Shape::kHalfSpace;
    r.point = vec(v, 1);
    r.normal = vec(v, 4);
  }
  return r;
}

}  // namespace

Result<Scene> scene_of(const SceneSource& source, const SceneOverrides& overrides) {
  SceneFolders folders(source.folder);
  folders.meshes = source.mesh_folders;
  return scene_of(source, overrides, folders);
}

Result<Scene> scene_of(const SceneSource& source, const SceneOverrides& overrides, const SceneFolders& folders) {
  auto scene = parse_scene(source.text, source.name, folders);
  if (!scene) return scene;
  if (!overrides.scripted) scene->commands.clear();
  if (overrides.time_step > 0) {
    scene->simulation.time_step = overrides.time_step;
    if (const std::string fault = time_step_fault(scene->simulation); !fault.empty())
      return bad_input(fmt::format("{}: {}; give another one instead of the scene's", source.name, fault));
  }
  if (overrides.dust) scene->cut.dust = *overrides.dust;
  return scene;
}

namespace {
SceneFrame frame_of(const SessionChange& c) { return c.values[0] != 0 ? SceneFrame::kRest : SceneFrame::kWorld; }
}  // namespace

Status apply(Session& session, const SessionChange& c) {
  KERF_TRY(check(c));
  SceneCommand command;
  switch (c.kind) {
    case Kind::kBeginStroke:
      return session.begin_stroke(c.values.size() > 1 && c.values[1] != 0 ? SceneFrame::kRest : SceneFrame::kWorld,
                                  c.values[0] != 0);
    case Kind::kBlade: return session.move_blade(vec(c.values, 0), vec(c.values, 3));
    case Kind::kEndStroke: return session.end_stroke();
    case Kind::kLift: session.lift_blade(); return {};
    case Kind::kCancelStroke: return session.cancel_stroke();
    case Kind::kUndo: return session.undo();
    case Kind::kRedo: return session.redo();
    case Kind::kGrasp: {
      std::vector<CollisionVertex> points;
      for (const std::int32_t v : c.vertices) points.emplace_back(v);
      return session.grasp(c.id, points);
    }
    case Kind::kMove: {
      SceneMove move;
      move.id = c.id;
      move.to = vec(c.values, 0);
      move.over = std::max(0.0, c.values[3]);
      command.what = move;
      return session.apply(command);
    }
    case Kind::kRelease: command.what = SceneRelease{c.id}; return session.apply(command);
    case Kind::kFix: command.what = SceneFixCommand{region_of(c.values)}; return session.apply(command);
    case Kind::kUnfix: command.what = SceneUnfix{region_of(c.values)}; return session.apply(command);
    case Kind::kGravity: return session.set_gravity(vec(c.values, 0));
    case Kind::kTool: {
      SceneToolMotion motion;
      motion.id = c.id;
      motion.poses = {{std::max(0.0, c.values[6]), vec(c.values, 0), vec(c.values, 3)}};
      command.what = motion;
      return session.apply(command);
    }
    case Kind::kJaws: {
      SceneJaws jaws;
      jaws.id = c.id;
      jaws.close = c.values[0] != 0;
      jaws.over = std::max(0.0, c.values[1]);
      command.what = jaws;
      return session.apply(command);
    }
    case Kind::kMaterial: return session.set_material(c.values[0], c.values[1], c.values[2]);
    case Kind::kPunch: {
      ScenePunch punch;
      punch.shape = ScenePunchShape::kPolygon;
      punch.frame = c.values[0] == 1 || c.values[0] == 3 ? SceneFrame::kRest : SceneFrame::kWorld;
      punch.take = c.values[0] >= 2;
      if (c.values[1] >= 0) punch.reach = c.values[1];
      punch.roughness = c.values[2];
      punch.point = vec(c.values, 3);
      punch.axis = vec(c.values, 6);
      punch.across = vec(c.values, 9);
      for (std::size_t i = 12; i + 1 < c.values.size(); i += 2) punch.points.push_back({c.values[i], c.values[i + 1]});
      command.what = punch;
      return session.apply(command);
    }
    case Kind::kShave: {
      const Shaver shaver{vec(c.values, 1), vec(c.values, 4), c.values[7]};
      const auto done = session.shave(shaver, frame_of(c), c.values[8], c.values[9]);
      return done ? Status{} : Status(done.error());
    }
    case Kind::kRemove: {
      const auto done = session.remove_piece(CollisionTriangle(c.vertices[0]));
      return done ? Status{} : Status(done.error());
    }
    case Kind::kSuck: {
      const auto done = session.remove_pieces(region_of(c.values), SceneFrame::kWorld);
      return done ? Status{} : Status(done.error());
    }
  }
  return {};
}

namespace {

/// The scene of a recording, with what it carries on disk while it is loaded.
struct UnpackedScene {
  std::optional<TemporaryFolder> folder;
  Scene scene;
};

Result<UnpackedScene> unpacked_scene(const Recording& recording, const std::vector<std::filesystem::path>& mesh_folders,
                                     const std::string& file) {
  SceneSource source = recording.source;
  if (!file.empty()) source.name = fmt::format("{} (its scene {})", file, source.name);
  source.mesh_folders.insert(source.mesh_folders.end(), mesh_folders.begin(), mesh_folders.end());
  UnpackedScene out;
  if (!source.files.empty() || !source.meshes.empty()) {
    auto made = TemporaryFolder::create();
    if (!made) return made.error();
    out.folder.emplace(std::move(made).value());
  }
  if (!source.files.empty()) {
    for (const SceneSource::File& f : source.files) {
      if (!plain_file_name(f.name)) return bad_input("a file of the recording has no plain name");
      KERF_TRY(replace_file((out.folder->path() / f.name).string(), f.bytes));
    }
    source.folder = out.folder->path();
  }
  SceneFolders folders(source.folder);
  folders.meshes = source.mesh_folders;
  if (!source.meshes.empty()) {
    auto unpacked = unpack_meshes(source, out.folder->path());
    if (!unpacked) return unpacked.error();
    folders = std::move(unpacked).value();
  }
  auto scene = scene_of(source, recording.overrides, folders);
  if (!scene) return scene.error();
  KERF_TRY(check_meshes(*scene, source));
  out.scene = std::move(*scene);
  return out;
}

}  // namespace

Result<Scene> scene_of(const Recording& recording, const std::vector<std::filesystem::path>& mesh_folders,
                       const std::string& file) {
  auto unpacked = unpacked_scene(recording, mesh_folders, file);
  if (!unpacked) return unpacked.error();
  return std::move(unpacked->scene);
}

Result<Session> session_of(const Recording& recording, const Progress& progress,
                           const std::vector<std::filesystem::path>& mesh_folders, const std::string& file) {
  const auto unpacked = unpacked_scene(recording, mesh_folders, file);
  if (!unpacked) return unpacked.error();
  return Session::create(unpacked->scene, progress);
}

void Replay::begin(Session& session) { arrive(session); }

Result<SessionStep> Replay::step(Session& session) {
  auto done = session.step();
  if (!done) return done;
  ++report_.steps;
  arrive(session);
  return done;
}

void Replay::arrive(Session& session) {
  const std::int64_t step = report_.steps;
  const auto compare = [&](std::uint64_t expected) {
    ++report_.hashes;
    if (report_.first_difference < 0 && session.hash() != expected) report_.first_difference = step;
  };
  for (; hash_ < recording_->hashes.size() && recording_->hashes[hash_].step == step; ++hash_)
    compare(recording_->hashes[hash_].hash);
  for (; change_ < recording_->changes.size() && recording_->changes[change_].step == step; ++change_)
    if (const Status done = apply(session, recording_->changes[change_]); !done && report_.refused++ == 0)
      report_.first_refused = fmt::format("changes[{}] (\"{}\" at step {}): {}", change_,
                                          change_word(recording_->changes[change_].kind), step, done.error().message);
  if (!over()) return;
  compare(recording_->end_hash);
  report_.score = session.score();
}

Result<ReplayReport> replay(const Recording& recording, const Progress& progress,
                            const std::vector<std::filesystem::path>& mesh_folders, const std::string& file) {
  auto session = session_of(recording, progress, mesh_folders, file);
  if (!session) return session.error();
  Replay replay(recording);
  replay.begin(*session);
  while (!replay.over()) {
    KERF_TRY(
        progress("replaying", static_cast<double>(replay.report().steps) / static_cast<double>(recording.last_step)));
    if (auto done = replay.step(*session); !done) return done.error();
  }
  return replay.report();
}

}  // namespace kerf
