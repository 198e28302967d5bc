// A session while memory runs out: requests are refused once, one after the other. What was asked for is done or thrown out of, and the program goes on.
#include <gtest/gtest.h>

#include <optional>

#include "kerf/session/session.h"

#include "session/make_session.h"
#include "support/refused_new.h"

namespace kerf::no_memory_test {
namespace {

Scene strip() {
  Scene scene;
  scene.body.model = "strip";
  scene.simulation.threads = 1;
  return scene;
}

/// Across the strip, and on.
void cut(Session& session) {
  Box3 box;
  for (const Vec3 p : session.body().complex.collision.rest.raw()) box.add(p);
  const Vec3 c = box.center(), s = box.size();
  const Vec3 up{0, 0, norm(s)};
  ASSERT_TRUE(session.begin_stroke(SceneFrame::kRest, true).ok());
  for (int i = 0; i <= 4; ++i) {
    const Vec3 at{c.x + 0.1 * s.x, c.y + (-0.8 + 0.4 * i) * s.y, c.z};
    ASSERT_TRUE(session.move_blade(at + up, at - up).ok());
  }
  ASSERT_TRUE(session.end_stroke().ok());
}

std::uint64_t life(std::optional<Session>& session) {
  auto made = Session::create(strip());
  if (!made.ok()) {
    const test::NothingRefused here;
    EXPECT_EQ(made.error().kind, ErrorKind::kFailed);
    EXPECT_NE(made.error().message.find("not enough memory to make"), std::string::npos) << made.error().message;
    throw std::bad_alloc();
  }
  session.emplace(std::move(*made));
  cut(*session);
  EXPECT_TRUE(session->step(2).ok());
  EXPECT_TRUE(session->undo().ok());
  EXPECT_TRUE(session->redo().ok());
  return session->hash();
}

/// Refuses every `step`-th request of a life. Whatever is refused, nothing ends the program, and the next session is as the first.
void fail_at(long step) {
  std::optional<Session> session;
  const std::uint64_t usual = life(session);
  std::uint64_t came = 0;
  const long refusals = test::with_requests_refused(
      0, step,
      [&] {
        came = 0;
        came = life(session);
      },
      [&](bool, bool thrown) {
        if (!thrown) {
          EXPECT_EQ(came, usual);
        }
        session.reset();  // whatever is there of it
      });
  EXPECT_GT(refusals, 10);
  EXPECT_EQ(life(session), usual);
}

TEST(SessionNoMemory, PartsOfALifeCanFail) { fail_at(97); }
TEST(SessionNoMemory, EveryPartOfALifeCanFail) { fail_at(1); }

}  // namespace
}  // namespace kerf::no_memory_test
