// Recordings as text: they come back to the bit, and hostile ones are refused.
#include "kerf/session/recording.h"

#include <gtest/gtest.h>

#include "kerf/base/random.h"

namespace kerf {
namespace {

Recording example() {
  Recording r;
  r.source.name = "sheet";
  r.source.text = "[body]\nmodel = \"sheet\"\n";
  r.source.files.push_back({"a.bin", std::string("\0\xff\x80z", 4)});
  r.source.files.push_back({"b.bin", "12345"});
  r.overrides = {false, 0.0123456789012345678};
  r.instructions = instruction_set();
  SessionChange blade;
  blade.kind = SessionChange::Kind::kBlade;
  blade.step = 3;
  blade.values = {0.1, 1.0 / 3, -1e-300, 5e-324, 1e300, -0.0};
  SessionChange grasp;
  grasp.kind = SessionChange::Kind::kGrasp;
  grasp.step = 4;
  grasp.id = "hand \"1\"\n";
  grasp.vertices = {1, 2, 2147483647};
  SceneRegion region;
  region.shape = SceneRegion::Shape::kSphere;
  region.center = {1, 2, 3};
  region.radius = 0.1;
  SessionChange fix = region_change(SessionChange::Kind::kFix, region);
  fix.step = 4;
  r.changes = {blade, grasp, fix};
  r.hashes = {{0, 0xffffffffffffffffull}, {100, 1}};
  r.last_step = 123;
  r.end_hash = 0xabcdef;
  return r;
}

TEST(Recording, ComesBackToTheBit) {
  const Recording r = example();
  auto back = parse_recording(recording_text(r), "test");
  ASSERT_TRUE(back.ok()) << back.error().message;
  EXPECT_EQ(back->source.text, r.source.text);
  ASSERT_EQ(back->source.files.size(), 2u);
  EXPECT_EQ(back->source.files[0].bytes, r.source.files[0].bytes);
  EXPECT_EQ(back->source.files[1].bytes, "12345");
  EXPECT_EQ(back->overrides.time_step, r.overrides.time_step);
  ASSERT_EQ(back->changes.size(), 3u);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(back->changes[i].kind, r.changes[i].kind);
    EXPECT_EQ(back->changes[i].id, r.changes[i].id);
    EXPECT_EQ(back->changes[i].vertices, r.changes[i].vertices);
    ASSERT_EQ(back->changes[i].values.size(), r.changes[i].values.size());
    for (std::size_t k = 0; k < r.changes[i].values.size(); ++k)
      EXPECT_EQ(std::bit_cast<std::uint64_t>(back->changes[i].values[k]), std::bit_cast<std::uint64_t>(r.changes[i].values[k]));
  }
  EXPECT_EQ(back->hashes[0].hash, 0xffffffffffffffffull);
  EXPECT_EQ(back->last_step, 123);
  EXPECT_EQ(back->end_hash, 0xabcdefu);
}

TEST(Recording, HostileTextsAreRefusedOrRead) {
  const std::string good = recording_text(example());
  for (std::size_t n = 0; n + 2 < good.size(); ++n) EXPECT_FALSE(parse_recording(good.substr(0, n), "cut").ok()) << n;
  EXPECT_FALSE(parse_recording("", "x").ok());
  EXPECT_FALSE(parse_recording("[]", "x").ok());
  EXPECT_FALSE(parse_recording("{}", "x").ok());
  EXPECT_FALSE(parse_recording("{\"kerf_recording\":2}", "x").ok());
  EXPECT_FALSE(parse_recording(std::string(200'000, '['), "deep").ok());
  const auto replaced = [&](const std::string& from, const std::string& to) {
    std::string text = good;
    const std::size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    text.replace(at, from.size(), to);
    auto read = parse_recording(text, "x.kerfrec");
    if (read) return std::string();
    EXPECT_EQ(read.error().message.rfind("x.kerfrec: ", 0), 0u);
    return read.error().message;
  };
  EXPECT_NE(replaced("\"blade\"", "\"blades\""), "");
  EXPECT_NE(replaced("[3,\"blade\"", "[-3,\"blade\""), "");
  EXPECT_NE(replaced("[3,\"blade\"", "[5,\"blade\""), "");            // out of order
  EXPECT_NE(replaced("[3,\"blade\"", "[3.5,\"blade\""), "");
  EXPECT_NE(replaced("[3,\"blade\"", "[18446744073709551615,\"blade\""), "");
  EXPECT_NE(replaced("\"last_step\":123", "\"last_step\":99"), "");  // a hash after the end
  EXPECT_NE(replaced("\"last_step\":123", "\"last_step\":1e99"), "");
  EXPECT_NE(replaced("2147483647", "2147483648"), "");
  EXPECT_NE(replaced("2147483647", "1.5"), "");
  EXPECT_NE(replaced("1e+300", "1e999"), "");
  EXPECT_NE(replaced("1e+300", "null"), "");
  EXPECT_NE(replaced("1e+300,", ""), "");
  EXPECT_NE(replaced("\"a.bin\"", "\"../a.bin\""), "");
  EXPECT_NE(replaced("\"a.bin\"", "7"), "");
  EXPECT_NE(replaced("ffffffffffffffff", "fffffffffffffffff"), "");
  EXPECT_NE(replaced("ffffffffffffffff", "xyz"), "");
  EXPECT_NE(replaced("\"scripted\":false,", ""), "");
  EXPECT_NE(replaced("\"end\":\"0000000000abcdef\"", "\"end\":7"), "");
  Random random(5);
  for (int i = 0; i < 3000; ++i) {
    std::string text = good;
    for (int k = 0; k < 3; ++k) text[static_cast<std::size_t>(random.index(static_cast<int>(text.size())))] = static_cast<char>(random.index(256));
    (void)parse_recording(text, "x").ok();
  }
}

TEST(Recording, ReplaySaysWhereTheBitsDiffer) {
  Recording r;
  r.source.name = "sheet";
  r.source.text = "[body]\nmodel = \"sheet\"\n[simulation]\ntime_step = 0.01\n";
  auto scene = scene_of(r.source, r.overrides);
  ASSERT_TRUE(scene.ok());
  auto session = Session::create(*scene);
  ASSERT_TRUE(session.ok());
  r.hashes.push_back({0, session->hash()});
  ASSERT_TRUE(session->step(5).ok());
  r.hashes.push_back({5, session->hash()});
  ASSERT_TRUE(session->step(5).ok());
  r.end_hash = session->hash();
  r.last_step = 10;
  auto same = replay(r);
  ASSERT_TRUE(same.ok());
  EXPECT_EQ(same->first_difference, -1);
  EXPECT_EQ(same->hashes, 3);
  r.end_hash ^= 1;
  EXPECT_EQ(replay(r)->first_difference, 10);
  r.hashes[1].hash ^= 1;
  EXPECT_EQ(replay(r)->first_difference, 5);
  r.source.text = "[body]\nmodel = \"no such thing\"\n";
  EXPECT_FALSE(replay(r).ok());
}

}  // namespace
}  // namespace kerf
