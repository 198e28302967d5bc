#include "exit_status.h"

#include <new>

#include "kerf/base/parallel.h"

namespace kerf::app {

const char* what_lacks(const std::exception& error) {
  if (dynamic_cast<const std::bad_alloc*>(&error))
    return "not enough memory; use smaller meshes, or let the program have more (ulimit -v)";
  if (is_lack_of_threads(error))
    return "no thread could be made; let the program have more memory (ulimit -v) or processes (ulimit -u), or one thread alone: "
           "kerf run --threads 1";
  return nullptr;
}

}  // namespace kerf::app
