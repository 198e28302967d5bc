// A session of a scene that must be right.
#pragma once

#include <gtest/gtest.h>

#include <utility>

#include "kerf/session/session.h"

namespace kerf::test {

inline Session make(const Scene& scene) {
  auto session = Session::create(scene);
  EXPECT_TRUE(session.ok()) << (session.ok() ? "" : session.error().message);
  return std::move(session).value();
}

}  // namespace kerf::test
