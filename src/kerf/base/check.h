// Programmer errors: a broken precondition stops the program in debug builds and costs nothing in release.
#pragma once

#include <cassert>

#define KERF_ASSERT(condition) assert(condition)
