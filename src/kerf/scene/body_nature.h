// Numbers of a body's material, as people and files give them.
#pragma once

#include <string>

#include "kerf/base/result.h"
#include "kerf/binding/bound_body_file.h"

namespace kerf {

/// Bad input where a number lies outside of the range that the key of [material] has. `name` begins the message.
Status check_nature(const BodyNature& nature, const std::string& name);

}  // namespace kerf
