#include "kerf/engine/scene_loader.h"

#include <fmt/format.h>

#include <algorithm>
#include <exception>
#include <new>

#include "kerf/base/parallel.h"
#include "kerf/mesh/mesh_file.h"
#include "kerf/mesh/surface_tolerances.h"
#include "kerf/mesh/whole_file.h"
#include "kerf/scene/body_scene.h"
#include "kerf/scene/ways_out.h"

namespace kerf {
namespace {

/// A page may send a scene, not ask for this machine's files through one: an upload names what came with it.
SceneFolders folders_of(const SceneRequest& request) {
  SceneFolders folders(request.source.folder);
  folders.meshes = request.source.mesh_folders;
  if (!request.folder) return folders;
  folders.only.emplace();
  for (const SceneSource::File& file : request.source.files) folders.only->push_back(file.name);
  return folders;
}

Result<Box3> mesh_box(const std::string& file) {
  auto mesh = read_mesh(file);
  if (!mesh) return mesh.error();
  Box3 box;
  for (const Vec3 p : mesh->positions) box.add(p);
  return box;
}

/// The scene of uploaded meshes.
Result<std::string> upload_text(const std::string& title, UploadedMeshes& meshes, const std::filesystem::path& folder) {
  if (!meshes.bound.empty()) {
    meshes.unit = 1;
    return body_scene_text(title, folder / meshes.bound);
  }
  std::string text = fmt::format("title = \"{}\"\n[body]\n", title);
  const auto visual = mesh_box((folder / meshes.visual).string());
  if (!visual) return visual.error();
  if (meshes.unit == 0) {
    meshes.unit = guess_unit(visual->diagonal());
    meshes.guessed = true;
  }
  text += fmt::format("visual = \"{}\"\nscale = {}\n", meshes.visual, meshes.unit);
  if (!meshes.collision.empty()) text += fmt::format("collision = \"{}\"\n", meshes.collision);
  if (meshes.thickness_share > 0) meshes.thickness = meshes.thickness_share * visual->diagonal();
  if (meshes.thickness > 0) text += fmt::format("thickness = {}\n", meshes.thickness * meshes.unit);
  return text + far_rim_text(meshes.unit * visual->min.y, meshes.unit * visual->max.y);
}

}  // namespace

double guess_unit(double size) {
  double unit = 1;
  while (size * unit > kUsualLargest && unit > 1e-9) unit /= 1000;
  return unit;
}

namespace {

/// Messages name what a person opened, not where it was put for the moment, and what the page has, not the command line.
Error as_opened(Error error, const std::filesystem::path& folder, const std::string& name) {
  for (const Advice& way : kWaysOut)
    if (const std::size_t at = error.message.find(way.command_line); at != std::string::npos)
      error.message.replace(at, way.command_line.size(), way.page);
  const std::string place = (folder / "").string();
  for (std::size_t at = error.message.find(place); at != std::string::npos; at = error.message.find(place, at)) {
    error.message.erase(at, place.size());
    if (error.message.compare(at, 7, "visual.") == 0) error.message.replace(at, 6, name);
  }
  return error;
}

/// What pages are told of a session, as it is.
Status draw_first(LoadedScene& loaded) {
  Session& session = *loaded.session;
  for (const Vec3 p : session.body().complex.visual.rest.raw()) loaded.box.add(p);
  auto things = DrawnThings::create(session.scene(), loaded.box);
  if (!things) return things.error();
  loaded.things = std::move(things).value();
  session.watch_changes(true);
  loaded.drawn.reset(session.body());
  return {};
}

Result<std::unique_ptr<LoadedScene>> load_now(SceneRequest request, const Progress& progress) {
  auto out = std::make_unique<LoadedScene>();
  if (request.folder)
    for (const SceneSource::File& f : request.source.files)
      KERF_TRY(replace_file((request.folder->path() / f.name).string(), f.bytes));
  if (request.meshes) {
    KERF_TRY(progress("read", 0));
    auto text = upload_text(request.source.name, *request.meshes, request.folder->path());
    if (!text) return text.error();
    request.source.text = std::move(text).value();
  }
  SceneOverrides with_script = request.overrides;
  with_script.scripted = true;
  auto scene = scene_of(request.source, with_script, folders_of(request));
  if (!scene) return scene.error();
  if (request.meshes) scene->body.line = 0;  // nobody wrote that text
  out->script = scene_script(*scene);
  if (!request.overrides.scripted) scene->commands.clear();
  KERF_TRY(take_meshes(*scene, request.source));
  auto session = Session::create(*scene, progress);
  if (!session) return session.error();
  KERF_TRY(progress("picture", 0));
  out->source = std::move(request.source);
  out->overrides = request.overrides;
  out->meshes = std::move(request.meshes);
  out->folder = std::move(request.folder);
  out->session = std::make_shared<Session>(std::move(session).value());
  out->initial = out->session->snapshot();
  KERF_TRY(draw_first(*out));
  return out;
}

}  // namespace

Result<std::unique_ptr<LoadedScene>> scene_of_session(Session& session, SceneSource source) {
  auto out = std::make_unique<LoadedScene>();
  out->source = std::move(source);
  out->session = std::shared_ptr<Session>(std::shared_ptr<void>(), &session);
  KERF_TRY(draw_first(*out));
  return out;
}

Result<std::unique_ptr<LoadedScene>> load_scene(SceneRequest request, const Progress& progress) {
  if (!request.folder) return load_now(std::move(request), progress);
  const std::filesystem::path folder = request.folder->path();
  const std::string name = request.source.name;
  auto loaded = load_now(std::move(request), progress);
  if (!loaded) return as_opened(loaded.error(), folder, name);
  return loaded;
}

namespace {

Error no_thread() {
  return failed(
      "There is not enough memory for this scene, or no thread can be had to load it; what was shown stays. Let the program have more "
      "memory (ulimit -v) or processes (ulimit -u).");
}

}  // namespace

SceneLoader::~SceneLoader() {
  stop();
  if (job_ && job_->thread.joinable()) job_->thread.join();
  if (disposer_.joinable()) disposer_.join();
}

void SceneLoader::start(SceneRequest request) {
  wanted_ = true;
  client_ = request.client;
  input_ = request.input;
  if (!job_) return begin(std::move(request));
  job_->stop = true;
  next_ = std::move(request);
}

void SceneLoader::stop() {
  wanted_ = false;
  next_.reset();
  if (job_) job_->stop = true;
}

void SceneLoader::begin(SceneRequest request) {
  job_ = std::make_unique<Job>();
  Job& job = *job_;
  auto work = [&job, request = std::move(request)]() mutable {
    const auto tell = [&job](std::string_view stage, double fraction) {
      const Lock lock(job.mutex);
      job.where = {std::string(stage), fraction};
      return !job.stop;
    };
    // The standard library says by exceptions what the machine lacks; one that left a thread would end the program.
    try {
      job.outcome = load_scene(std::move(request), tell);
    } catch (const std::bad_alloc&) {
      job.outcome = failed("There is not enough memory for this scene; what was shown stays.");
    } catch (const std::exception& error) {
      job.outcome =
          is_lack_of_threads(error) ? no_thread() : failed(std::string("This scene can't be loaded: ") + error.what());
    }
    job.done = true;
  };
  try {
    job.thread = Thread(std::move(work));
  } catch (const std::exception&) {  // a thread needs a stack and a place among the processes
    job.outcome = no_thread();
    job.done = true;
  }
}

SceneLoader::Where SceneLoader::where() const {
  if (!job_ || next_) return {};
  const Lock lock(job_->mutex);
  return job_->where;
}

std::optional<Result<std::unique_ptr<LoadedScene>>> SceneLoader::take() {
  if (!job_ || !job_->done) return {};
  if (job_->thread.joinable()) job_->thread.join();
  auto outcome = std::move(job_->outcome);
  const bool stopped = job_->stop;
  job_.reset();
  if (!stopped) {
    wanted_ = false;
    return outcome;
  }
  if (outcome->ok()) dispose(std::move(*outcome).value());
  if (next_) {
    SceneRequest request = std::move(*next_);
    next_.reset();
    begin(std::move(request));
  }
  return {};
}

void SceneLoader::dispose(std::unique_ptr<LoadedScene> scene) {
  if (disposer_.joinable()) disposer_.join();
  try {
    disposer_ = Thread([scene = std::move(scene)]() mutable { scene.reset(); });
  } catch (const std::exception&) {
    // Without a thread the scene has been freed here, with the function that had it.
  }
}

}  // namespace kerf
