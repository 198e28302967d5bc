#include "command_cut.h"

#include "exit_status.h"

namespace kerf::app {

int cut_body(const CutOptions&) {
  return report(failed("cut: not built yet"));
}

}  // namespace kerf::app
