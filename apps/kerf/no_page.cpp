// Stands in for the page where none was built when the program was.
#include "view_server.h"

namespace kerf::app {
PageFiles built_in_page() { return {}; }
}  // namespace kerf::app
