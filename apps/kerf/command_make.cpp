#include "command_make.h"

#include "exit_status.h"

namespace kerf::app {

int make_meshes(const MakeOptions& options) {
  const Result<Model> model = make_model(options.model, options.options);
  if (!model.ok()) return report(model.error());
  return report(failed("make: writing meshes is not built yet"));
}

}  // namespace kerf::app
