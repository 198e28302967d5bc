#include "command_bind.h"

#include <fmt/format.h>

#include <cstdio>

#include "exit_status.h"
#include "folder.h"
#include "kerf/binding/bound_body_file.h"
#include "kerf/session/scene_body.h"
#include "progress_bar.h"

namespace kerf::app {
namespace {

Result<SceneBodyLoaded> bind_and_save(const BindOptions& options) {
  SceneBody body;
  body.visual = options.visual.string();
  body.collision = options.collision.string();
  body.scale = options.scale;
  body.thickness = options.thickness;
  body.exact_paths = options.exact_paths;
  ProgressBar bar(options.quiet);
  Result<SceneBodyLoaded> loaded = load_scene_body(body, bar.callback());
  if (!loaded.ok()) return loaded;
  if (options.out.has_parent_path()) KERF_TRY(make_folder(options.out.parent_path()));
  KERF_TRY(save_bound_body(loaded->bound, options.out));
  return loaded;
}

}  // namespace

int bind_meshes(const BindOptions& options) {
  const Result<SceneBodyLoaded> loaded = bind_and_save(options);
  if (!loaded.ok()) return report(loaded.error());
  if (options.quiet) return kSuccess;
  for (const std::string& note : loaded->notes) std::fprintf(stderr, "note: %s\n", note.c_str());
  const BindReport& r = loaded->bound.report;
  std::fputs(
      fmt::format("bound {} visual triangles to {} collision triangles ({}) in {:.3g} s; "
                  "re-meshing added {} vertices and {} triangles\nwritten to {}\n",
                  r.input_triangles, loaded->bound.complex.collision.face_count(),
                  r.closed ? "closed" : "open sheet", r.seconds.total, r.visual_vertices - r.input_vertices,
                  r.visual_triangles - r.input_triangles, options.out.string())
          .c_str(),
      stdout);
  return kSuccess;
}

}  // namespace kerf::app
