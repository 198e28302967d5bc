#include "command_bind.h"

#include "exit_status.h"

namespace kerf::app {

int bind_meshes(const BindOptions&) {
  return report(failed("bind: not built yet"));
}

}  // namespace kerf::app
