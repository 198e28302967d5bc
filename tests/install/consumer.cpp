#include <cstdio>

#include "kerf/mesh/models.h"
#include "kerf/session/scene_file.h"

int main() {
  const kerf::Result<kerf::Model> model = kerf::make_model("sheet", {});
  if (!model.ok()) return std::puts(model.error().message.c_str()), 1;
  const kerf::Result<kerf::Scene> scene = kerf::parse_scene("[body]\nmodel = \"sheet\"\n", "consumer.toml");
  if (!scene.ok()) return std::puts(scene.error().message.c_str()), 1;
  const std::size_t triangles = model->visual.triangles.size();
  std::printf("a %s of %zu triangles\n", scene->body.model.c_str(), triangles);
  return triangles > 0 ? 0 : 1;
}
