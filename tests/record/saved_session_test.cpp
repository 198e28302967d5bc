// Saved sessions: files that go on, and files that don't.
#include "kerf/record/saved_session.h"

#include <gtest/gtest.h>

#include <cstring>

#include "kerf/base/hash.h"

namespace kerf::saved_session_test {
namespace {

Recording scene() {
  Recording r;
  r.source.text =
      "[body]\nmodel = \"closed-sheet\"\noptions = { visual_triangles = 500 }\n[[command]]\ntype = \"fix\"\nat = 0.004\nsphere = { center = [0, 0, 0], radius = 0.3 }\n";
  r.source.name = "a-sheet";
  return r;
}
Session lived() {
  auto session = session_of(scene());
  EXPECT_TRUE(session.ok()) << (session.ok() ? "" : session.error().message);
  EXPECT_TRUE(session->step(3).ok());
  EXPECT_TRUE(session->begin_stroke(SceneFrame::kRest, true).ok());
  EXPECT_TRUE(session->move_blade({0.1, -1, 0.2}, {0.1, -1, -0.2}).ok());
  EXPECT_TRUE(session->move_blade({0.1, 1, 0.2}, {0.1, 1, -0.2}).ok());
  EXPECT_TRUE(session->end_stroke().ok());
  EXPECT_TRUE(session->step(3).ok());
  return std::move(session).value();
}
std::string saved(const Session& session) {
  auto bytes = saved_session_bytes(session, scene());
  EXPECT_TRUE(bytes.ok()) << (bytes.ok() ? "" : bytes.error().message);
  return bytes.ok() ? *bytes : std::string();
}
/// With the hash that its contents have.
std::string sealed(std::string bytes) {
  Hash hash;
  hash.add_bytes(bytes.data() + 24, bytes.size() - 24);
  const std::uint64_t value = hash.value();
  std::memcpy(bytes.data() + 16, &value, 8);
  return bytes;
}
void expect_refused(const std::string& bytes, const char* says) {
  const auto parsed = parse_saved_session(bytes, "a.kerfstate");
  ASSERT_FALSE(parsed.ok()) << says;
  EXPECT_NE(parsed.error().message.find(says), std::string::npos) << parsed.error().message;
  EXPECT_TRUE(parsed.error().message.starts_with("a.kerfstate: ")) << parsed.error().message;
}

TEST(SavedSession, GoesOnToTheSameBits) {
  Session session = lived();
  const auto parsed = parse_saved_session(saved(session), "a.kerfstate");
  ASSERT_TRUE(parsed.ok()) << parsed.error().message;
  auto other = go_on(*parsed);
  ASSERT_TRUE(other.ok()) << other.error().message;
  EXPECT_EQ(other->hash(), session.hash());
  EXPECT_EQ(other->counts().pieces, 2);
  ASSERT_TRUE(session.step(20).ok());
  ASSERT_TRUE(other->step(20).ok());
  EXPECT_EQ(other->hash(), session.hash());
}

TEST(SavedSession, TheSameLifeGivesTheSameBytes) { EXPECT_EQ(saved(lived()), saved(lived())); }

TEST(SavedSession, WhatIsNoneIsRefusedByName) {
  const std::string good = saved(lived());
  expect_refused("", "no saved state");
  expect_refused("KERFBODY12345678901234567890", "no saved state");
  for (const std::size_t n : {std::size_t{30}, good.size() / 2, good.size() - 1})
    expect_refused(good.substr(0, n), "cut off or damaged");
  expect_refused(good + "x", "cut off or damaged");
  for (const std::size_t at : {std::size_t{20}, std::size_t{40}, good.size() / 3, good.size() - 9}) {
    std::string bad = good;
    bad[at] = static_cast<char>(bad[at] ^ 4);
    expect_refused(bad, "cut off or damaged");
  }
  std::string newer = good;
  newer[8] = static_cast<char>(kSavedSessionVersion + 1);
  expect_refused(newer, "of version 2, and this kerf reads version 1");
  std::string elsewhere = good;
  const std::size_t at = elsewhere.find(instruction_set());
  ASSERT_NE(at, std::string::npos);
  elsewhere[at] = 'X';
  expect_refused(sealed(elsewhere), "would not go on to the same bits");
}

TEST(SavedSession, AnotherSceneIsRefused) {
  auto parsed = parse_saved_session(saved(lived()), "a.kerfstate");
  ASSERT_TRUE(parsed.ok());
  parsed->scene.source.text = "[body]\nmodel = \"steak\"\n";
  const auto other = go_on(*parsed, {}, {}, "a.kerfstate");
  ASSERT_FALSE(other.ok());
  EXPECT_NE(other.error().message.find("another body"), std::string::npos) << other.error().message;
}

}  // namespace
}  // namespace kerf::saved_session_test
