// Recordings as text: they come back to the bit, and hostile ones are refused.
#include "kerf/record/recording.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "kerf/base/random.h"
#include "kerf/scene/scene_body.h"
#include "kerf/scene/temporary_folder.h"

namespace kerf::recording_test {
namespace {

Recording example() {
  Recording r;
  r.source.name = "sheet";
  r.source.text = "[body]\nmodel = \"sheet\"\n";
  r.source.files.push_back({"a.bin", std::string("\0\xff\x80z", 4)});
  r.source.files.push_back({"b.bin", "12345"});
  r.source.meshes.push_back({"m.obj", 3, 0xc864724a99db7908ull, std::string("\xff\0v", 3)});
  r.source.meshes.push_back({"/far/n.obj", std::uint64_t{1} << 40, 7, std::nullopt});
  r.overrides = {false, 0.0123456789012345678};
  r.instructions = instruction_set();
  SessionChange blade;
  blade.kind = SessionChange::Kind::kBlade;
  blade.step = 3;
  blade.values = {0.1, 1.0 / 3, -1e-300, 5e-324, 1e6, -0.0};
  SessionChange grasp;
  grasp.kind = SessionChange::Kind::kGrasp;
  grasp.step = 4;
  grasp.id = "hand \"1\"\n";
  grasp.vertices = {1, 2, 2147483647};
  SceneRegion region;
  region.shape = SceneRegion::Shape::kSphere;
  region.center = {1, 2, 3};
  region.radius = 1e300;
  SessionChange fix = region_change(SessionChange::Kind::kFix, region);
  fix.step = 4;
  r.changes = {blade, grasp, fix};
  r.hashes = {{0, 0xffffffffffffffffull}, {100, 1}};
  r.last_step = 123;
  r.end_hash = 0xabcdef;
  return r;
}

TEST(Recording, WhatIsOutOfAllScaleIsRefusedByName) {
  const auto error_of = [](SessionChange::Kind kind, std::vector<double> values, std::string id = {}) {
    Recording r = example();
    SessionChange c;
    c.kind = kind;
    c.step = 4;
    c.id = std::move(id);
    c.values = std::move(values);
    r.changes.push_back(c);
    const auto back = parse_recording(recording_text(r), "x.kerfrec");
    return back ? std::string() : back.error().message;
  };
  using Kind = SessionChange::Kind;
  EXPECT_EQ(error_of(Kind::kGravity, {0, 0, -9.81}), "");
  EXPECT_EQ(error_of(Kind::kGravity, {0, 0, 1e5}),
            "x.kerfrec: changes[3]: gravity goes from -10000 to 10000 m/s2, but is 100000");
  EXPECT_EQ(error_of(Kind::kMaterial, {1e4, 0.3, 1000}), "");
  EXPECT_EQ(error_of(Kind::kMaterial, {1e300, 0.3, 1000}),
            "x.kerfrec: changes[3]: material: young must be at most 10000000000000, but is 1e+300");
  EXPECT_EQ(error_of(Kind::kMaterial, {1e4, 0.3, 1e-300}),
            "x.kerfrec: changes[3]: material: density must be at least 0.001, but is 1e-300");
  EXPECT_EQ(error_of(Kind::kMove, {0, 0, 1e6, 1e9}, "a"), "");
  EXPECT_EQ(error_of(Kind::kMove, {0, -1e100, 0, 1}, "a"),
            "x.kerfrec: changes[3]: \"move\" names a place 1e+100 m from the origin; 1e+06 m is the farthest");
  EXPECT_EQ(error_of(Kind::kBlade, {1e6, 0, 0, 0, 0, -1e6}), "");
  EXPECT_EQ(error_of(Kind::kBlade, {1e6, 0, 0, 0, 0, -1e300}),
            "x.kerfrec: changes[3]: \"blade\" names a place 1e+300 m from the origin; 1e+06 m is the farthest");
  EXPECT_NE(error_of(Kind::kTool, {1e7, 0, 0, 0, 0, 0, 1}, "a"), "");
  EXPECT_NE(error_of(Kind::kShave, {0, 0, 0, 0, 0, 0, 1e300, 0.1, 0, 0}), "");
  EXPECT_EQ(error_of(Kind::kSuck, {1, 0, 0, 0, 1e300}), "");  // everything
  EXPECT_NE(error_of(Kind::kSuck, {2, 0, 0, 1e300, 0, 0, 1}), "");
  EXPECT_EQ(error_of(Kind::kFix, {2, 0, 0, 0, 0, 0, 1e300}), "");  // a direction has any length
}

TEST(Recording, ComesBackToTheBit) {
  const Recording r = example();
  auto back = parse_recording(recording_text(r), "test");
  ASSERT_TRUE(back.ok()) << back.error().message;
  EXPECT_EQ(back->source.text, r.source.text);
  ASSERT_EQ(back->source.files.size(), 2u);
  EXPECT_EQ(back->source.files[0].bytes, r.source.files[0].bytes);
  EXPECT_EQ(back->source.files[1].bytes, "12345");
  ASSERT_EQ(back->source.meshes.size(), 2u);
  EXPECT_EQ(back->source.meshes[0].written, "m.obj");
  EXPECT_EQ(back->source.meshes[0].content, r.source.meshes[0].content);
  EXPECT_EQ(back->source.meshes[0].hash, 0xc864724a99db7908ull);
  EXPECT_EQ(back->source.meshes[1].bytes, std::uint64_t{1} << 40);
  EXPECT_FALSE(back->source.meshes[1].content);
  EXPECT_TRUE(compare(r, *back).none());
  EXPECT_EQ(back->overrides.time_step, r.overrides.time_step);
  ASSERT_EQ(back->changes.size(), 3u);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(back->changes[i].kind, r.changes[i].kind);
    EXPECT_EQ(back->changes[i].id, r.changes[i].id);
    EXPECT_EQ(back->changes[i].vertices, r.changes[i].vertices);
    ASSERT_EQ(back->changes[i].values.size(), r.changes[i].values.size());
    for (std::size_t k = 0; k < r.changes[i].values.size(); ++k)
      EXPECT_EQ(std::bit_cast<std::uint64_t>(back->changes[i].values[k]),
                std::bit_cast<std::uint64_t>(r.changes[i].values[k]));
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
  EXPECT_NE(replaced("[3,\"blade\"", "[5,\"blade\""), "");  // out of order
  EXPECT_NE(replaced("[3,\"blade\"", "[3.5,\"blade\""), "");
  EXPECT_NE(replaced("[3,\"blade\"", "[18446744073709551615,\"blade\""), "");
  EXPECT_NE(replaced("\"last_step\":123", "\"last_step\":99"), "");  // a hash after the end
  EXPECT_NE(replaced("\"last_step\":123", "\"last_step\":1e99"), "");
  EXPECT_NE(replaced("2147483647", "2147483648"), "");
  EXPECT_NE(replaced("2147483647", "1.5"), "");
  EXPECT_EQ(replaced("\"blade\"", "\"blades\""), "x.kerfrec: changes[0]: there is no change \"blades\"");
  EXPECT_NE(replaced("1e+300", "1e999"), "");
  EXPECT_NE(replaced("1e+300", "null"), "");
  EXPECT_NE(replaced("5e-324,", ""), "");
  EXPECT_NE(replaced("\"a.bin\"", "\"../a.bin\""), "");
  EXPECT_NE(replaced("\"a.bin\"", "7"), "");
  EXPECT_NE(replaced("\"bytes\":3", "\"bytes\":4"), "");
  EXPECT_NE(replaced("\"bytes\":3", "\"bytes\":-3"), "");
  EXPECT_NE(replaced("\"file\":\"m.obj\"", "\"file\":1"), "");
  EXPECT_NE(replaced("c864724a99db7908", "hash"), "");
  EXPECT_NE(replaced("ffffffffffffffff", "fffffffffffffffff"), "");
  EXPECT_NE(replaced("ffffffffffffffff", "xyz"), "");
  EXPECT_NE(replaced("\"scripted\":false,", ""), "");
  EXPECT_NE(replaced("\"end\":\"0000000000abcdef\"", "\"end\":7"), "");
  // The key, the entry and what stands there.
  EXPECT_EQ(replaced("[3,\"blade\"", "[-3,\"blade\""),
            "x.kerfrec: changes[0]: its step must be a whole number from 0 to 1000000000, but is -3");
  EXPECT_EQ(replaced("\"last_step\":123", "\"last_step\":\"9\""),
            "x.kerfrec: \"last_step\" must be a whole number from 0 to 1000000000, but is \"9\"");
  EXPECT_EQ(replaced("\"end\":\"0000000000abcdef\"", "\"end\":\"xyz\""),
            "x.kerfrec: \"end\" must be a text of at most 16 hexadecimal digits, but is \"xyz\"");
  EXPECT_EQ(replaced("ffffffffffffffff", "xyz"),
            "x.kerfrec: hashes[0]: its hash must be a text of at most 16 hexadecimal digits, but is \"xyz\"");
  EXPECT_EQ(replaced("\"a.bin\"", "\"../a.bin\""),
            "x.kerfrec: files[0]: \"name\" must be the name of a file without a folder, but is \"../a.bin\"");
  EXPECT_EQ(replaced("\"bytes\":3", "\"bytes\":[]"),
            "x.kerfrec: meshes[0]: \"bytes\" must be a whole number, but is a list");
  Random random(5);
  for (int i = 0; i < 3000; ++i) {
    std::string text = good;
    for (int k = 0; k < 3; ++k)
      text[static_cast<std::size_t>(random.index(static_cast<int>(text.size())))] =
          static_cast<char>(random.index(256));
    (void)parse_recording(text, "x").ok();
  }
}

TEST(Recording, AFileIsLookedAtBeforeItIsRead) {
  auto folder = TemporaryFolder::create();
  ASSERT_TRUE(folder);
  const std::string path = (folder->path() / "a.kerfrec").string();
  const auto put = [&](const std::string& text, std::uintmax_t size) {
    std::ofstream(path, std::ios::binary) << text;
    if (size > 0) std::filesystem::resize_file(path, size);
  };
  const auto refused = [&](const std::string& why) {
    const auto read = read_recording(path);
    ASSERT_FALSE(read) << why;
    EXPECT_EQ(read.error().message.find(path + ": "), 0U) << read.error().message;
    EXPECT_NE(read.error().message.find(why), std::string::npos) << read.error().message;
  };
  put(recording_text(example()), 0);
  EXPECT_TRUE(read_recording(path));
  put(recording_text(example()), std::uintmax_t{1} << 43);
  refused("the file has 8.8 TB, a recording has 1.07 GB at most");
  put("\0", 1 << 20);
  refused("this is no recording");
  put("{\"kerf_recording\": 77, ", 1 << 20);
  refused("another version");
  put("{\"kerf_recording\":1,", 1 << 20);
  refused("not JSON");
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
  const auto without = replay(r), with = replay(r, {}, {}, "out/sheet.kerfrec");
  ASSERT_FALSE(without.ok());
  EXPECT_EQ(without.error().message.find("sheet:2: "), 0u) << without.error().message;
  ASSERT_FALSE(with.ok());
  EXPECT_EQ(with.error().message.find("out/sheet.kerfrec (its scene sheet):2: "), 0u) << with.error().message;
}

TEST(Recording, ItsTimeStepHasTheLimitsOfAScenes) {
  Recording r;
  r.source.name = "sheet";
  r.source.text = "[body]\nmodel = \"sheet\"\n[simulation]\nduration = 2e3\n";
  const auto error_with = [&](double time_step) {
    r.overrides.time_step = time_step;
    const auto played = replay(r, {}, {}, "a.kerfrec");
    return played.ok() ? std::string() : played.error().message;
  };
  EXPECT_EQ(error_with(1e3), "");
  EXPECT_EQ(error_with(1e9).find("a.kerfrec (its scene sheet): time_step of [simulation] goes up to 1000 s"), 0U)
      << error_with(1e9);
  r.source.text = "[body]\nmodel = \"sheet\"\n[simulation]\nduration = 2\n";
  EXPECT_NE(error_with(3).find("time_step of [simulation] (3 s) is longer than its duration (2 s)"), std::string::npos)
      << error_with(3);
}

TEST(Recording, AReplayTellsWhatWasRefused) {
  Recording r;
  r.source.name = "sheet";
  r.source.text = "[body]\nmodel = \"sheet\"\n[simulation]\ntime_step = 0.01\n";
  const auto session = session_of(r);
  ASSERT_TRUE(session.ok());
  r.end_hash = session->hash();
  const auto add = [&](SessionChange::Kind kind, std::vector<double> values, std::vector<std::int32_t> vertices = {}) {
    r.changes.push_back({0, kind, {}, std::move(vertices), std::move(values)});
  };
  add(SessionChange::Kind::kBeginStroke, {1});
  add(SessionChange::Kind::kBlade, {5, 5, 5, 5, 5, 6});  // meets nothing: done all the same
  add(SessionChange::Kind::kEndStroke, {});
  auto played = replay(r);
  ASSERT_TRUE(played.ok());
  EXPECT_EQ(played->refused, 0U);
  EXPECT_EQ(played->first_refused, "");
  add(SessionChange::Kind::kUndo, {});
  add(SessionChange::Kind::kBlade, {0, 0, 0, 0, 0, 1});  // of no stroke
  add(SessionChange::Kind::kRemove, {}, {1'000'000'000});
  played = replay(r);
  ASSERT_TRUE(played.ok());
  EXPECT_EQ(played->first_difference, -1);
  EXPECT_EQ(played->refused, 3U);
  EXPECT_EQ(played->first_refused.find("changes[3] (\"undo\" at step 0): "), 0U) << played->first_refused;
}

TEST(Recording, AReplayStopsOnTheWay) {
  Recording r;
  r.source.name = "sheet";
  r.source.text = "[body]\nmodel = \"sheet\"\n[simulation]\ntime_step = 0.01\n";
  SessionChange push;
  push.kind = SessionChange::Kind::kGravity;
  push.values = {1, 0, -9};
  r.changes = {push};
  push.step = 2;
  push.values = {0, 0, -1};
  r.changes.push_back(push);
  r.last_step = 4;
  auto played = session_of(r), alone = session_of(r);
  ASSERT_TRUE(played.ok() && alone.ok());
  Replay replay(r);
  replay.begin(*played);
  for (int step = 0;; ++step) {
    if (step % 2 == 0 && step < 4) {
      ASSERT_TRUE(alone->set_gravity(step == 0 ? Vec3{1, 0, -9} : Vec3{0, 0, -1}).ok());
    }
    EXPECT_EQ(played->hash(), alone->hash()) << step;
    EXPECT_EQ(replay.report().steps, step);
    if (replay.over()) break;
    ASSERT_TRUE(replay.step(*played).ok() && alone->step().ok());
  }
  EXPECT_EQ(played->step_count(), 4);
  EXPECT_EQ(replay.report().first_difference, 4);  // the recording has no such end
  EXPECT_EQ(replay.report().hashes, 1);
}

TEST(Recording, APunchIsItsOutline) {
  Recording r;
  r.source.name = "sheet";
  r.source.text = "[body]\nmodel = \"sheet\"\n";
  ScenePunch punch;
  punch.radius = 0.2;
  for (const ScenePunchShape shape : {ScenePunchShape::kCircle, ScenePunchShape::kD}) {
    auto round = session_of(r), corners = session_of(r);
    ASSERT_TRUE(round.ok() && corners.ok());
    punch.shape = shape;
    punch.points = {};
    SceneCommand command;
    command.what = punch;
    ASSERT_TRUE(round->apply(command).ok());
    punch.points = corners->outline_of(punch);
    EXPECT_GE(punch.points.size(), 8U);
    punch.shape = ScenePunchShape::kPolygon;
    EXPECT_EQ(corners->outline_of(punch).size(), punch.points.size());
    command.what = punch;
    ASSERT_TRUE(corners->apply(command).ok());
    EXPECT_EQ(round->hash(), corners->hash());
    EXPECT_EQ(round->undo_depth(), 1);
  }
}

/// A cloth in a folder of its own, and a session of it that was cut.
class MeshesTravel : public testing::Test {
 protected:
  void SetUp() override {
    auto made = TemporaryFolder::create();
    ASSERT_TRUE(made.ok());
    folder_.emplace(std::move(*made));
    write("meshes/cloth.obj", grid(12, 0));
    recording_.source.name = "cloth";
    recording_.source.folder = folder_->path() / "meshes";
    recording_.source.text = "[body]\nvisual = \"cloth.obj\"\nthickness = 0.05\n[simulation]\ntime_step = 0.01\n";
  }
  static std::string grid(int n, double lift) {
    std::string text;
    for (int j = 0; j <= n; ++j)
      for (int i = 0; i <= n; ++i)
        text += "v " + std::to_string(1.0 * i / n) + " " + std::to_string(1.0 * j / n) + " " +
                std::to_string(lift * i * i) + "\n";
    for (int j = 0; j < n; ++j)
      for (int i = 0; i < n; ++i) {
        const int a = j * (n + 1) + i + 1;
        const auto face = [&](int x, int y, int z) {
          text += "f " + std::to_string(x) + " " + std::to_string(y) + " " + std::to_string(z) + "\n";
        };
        face(a, a + 1, a + n + 2);
        face(a, a + n + 2, a + n + 1);
      }
    return text;
  }
  void write(const std::string& name, const std::string& text) const {
    std::filesystem::create_directories((folder_->path() / name).parent_path());
    std::ofstream(folder_->path() / name) << text;
  }
  /// What a run leaves: `most` bytes of meshes travel.
  void record(std::size_t most) {
    auto scene = scene_of(recording_.source, recording_.overrides);
    ASSERT_TRUE(scene.ok()) << scene.error().message;
    ASSERT_TRUE(take_meshes(*scene, recording_.source, most).ok());
    auto session = Session::create(*scene);
    ASSERT_TRUE(session.ok()) << session.error().message;
    recording_.hashes = {{0, session->hash()}};
    SessionChange begin, a, b, end;
    begin.kind = SessionChange::Kind::kBeginStroke;
    begin.values = {1};
    a.kind = b.kind = SessionChange::Kind::kBlade;
    a.values = {-0.1, 0.43, 1, -0.1, 0.43, -1};
    b.values = {1.1, 0.57, 1, 1.1, 0.57, -1};
    end.kind = SessionChange::Kind::kEndStroke;
    recording_.changes = {begin, a, b, end};
    for (const SessionChange& c : recording_.changes) ASSERT_TRUE(apply(*session, c).ok());
    ASSERT_EQ(session->counts().pieces, 2);
    ASSERT_TRUE(session->step(20).ok());
    recording_.last_step = 20;
    recording_.end_hash = session->hash();
  }
  /// As it comes from a file, on another machine.
  [[nodiscard]] Recording elsewhere() const {
    auto read = parse_recording(recording_text(recording_), "cloth.kerfrec");
    EXPECT_TRUE(read.ok()) << (read.ok() ? "" : read.error().message);
    read->source.folder = "/nowhere";
    return std::move(*read);
  }
  std::optional<TemporaryFolder> folder_;
  Recording recording_;
};

// A body that a program has is in no folder: it goes along, and what comes back is the same to the bit.
TEST_F(MeshesTravel, ABodyOfAProgramTravels) {
  SceneBody body;
  body.model = "sheet";
  auto loaded = load_scene_body(body);
  ASSERT_TRUE(loaded.ok());
  loaded->young = 7e4;
  SceneFolders folders(folder_->path());
  folders.bodies["<mine>"] = std::make_shared<const SceneBodyLoaded>(std::move(*loaded));
  recording_.source.text =
      "[[body]]\nbound = \"<mine>\"\n[[body]]\nbound = \"<mine>\"\nposition = [0, 0, 0.5]\n[[body]]\nvisual = \"cloth.obj\"\n"
      "thickness = 0.05\nposition = [0, 0, 1]\n";
  const auto scene = scene_of(recording_.source, {}, [&] {
    SceneFolders here(recording_.source.folder);
    here.bodies = folders.bodies;
    return here;
  }());
  ASSERT_TRUE(scene.ok()) << scene.error().message;
  ASSERT_TRUE(take_meshes(*scene, recording_.source).ok());
  EXPECT_EQ(recording_.source.meshes.size(), 2U);
  auto session = Session::create(*scene);
  ASSERT_TRUE(session.ok()) << session.error().message;
  auto there = session_of(elsewhere());
  ASSERT_TRUE(there.ok()) << there.error().message;
  EXPECT_EQ(there->hash(), session->hash());
  EXPECT_EQ(there->material().young, session->material().young);
  ASSERT_TRUE(session->step(5).ok());
  ASSERT_TRUE(there->step(5).ok());
  EXPECT_EQ(there->hash(), session->hash());
  const Status small = take_meshes(*scene, recording_.source, 1000);
  ASSERT_FALSE(small.ok());
  EXPECT_NE(small.error().message.find("<mine> has "), std::string::npos) << small.error().message;
}

TEST_F(MeshesTravel, ARecordingReplaysWhereItsMeshesAreNot) {
  record(kMostEmbedded);
  std::filesystem::remove_all(folder_->path() / "meshes");
  const auto played = replay(elsewhere());
  ASSERT_TRUE(played.ok()) << played.error().message;
  EXPECT_EQ(played->first_difference, -1);
  EXPECT_EQ(played->hashes, 2);
}

TEST_F(MeshesTravel, LargeOnesStayAndAreCheckedByTheirHash) {
  record(100);
  ASSERT_FALSE(recording_.source.meshes[0].content);
  const auto lost = replay(elsewhere());
  ASSERT_FALSE(lost.ok());
  EXPECT_NE(lost.error().message.find("--meshes"), std::string::npos) << lost.error().message;
  const auto found = replay(elsewhere(), {}, {"/also nowhere", folder_->path() / "meshes"});
  ASSERT_TRUE(found.ok()) << found.error().message;
  EXPECT_EQ(found->first_difference, -1);
  write("meshes/cloth.obj", grid(12, 1e-4));
  const auto other = replay(elsewhere(), {}, {folder_->path() / "meshes"});
  ASSERT_FALSE(other.ok());
  EXPECT_NE(other.error().message.find("is not the one that was recorded"), std::string::npos) << other.error().message;
  EXPECT_NE(other.error().message.find("cloth:2"), std::string::npos) << other.error().message;
}

// A mesh that travelled is not asked for in another place.
TEST_F(MeshesTravel, ADamagedOneIsToldByItsNameAndNumber) {
  record(kMostEmbedded);
  Recording damaged = elsewhere();
  (*damaged.source.meshes[0].content)[7] ^= 1;
  const auto read = parse_recording(recording_text(damaged), "cloth.kerfrec");
  ASSERT_FALSE(read.ok());
  EXPECT_EQ(read.error().message,
            "cloth.kerfrec: meshes[0]: \"cloth.obj\" is damaged: its bytes do not have the hash that was recorded; "
            "use another copy of the recording, or record it again");
  const auto played = replay(damaged);
  ASSERT_FALSE(played.ok());
  EXPECT_EQ(played.error().message.find("too large to travel"), std::string::npos) << played.error().message;
}

TEST_F(MeshesTravel, NamesInARecordingLeadNowhere) {
  record(kMostEmbedded);
  Recording bad = elsewhere();
  bad.source.meshes[0].written = "../../../../tmp/escaped/..obj/x";
  const auto played = replay(bad);
  ASSERT_FALSE(played.ok());
  bad = elsewhere();
  bad.source.meshes.push_back({"other.obj", 0, 0, ""});
  EXPECT_FALSE(replay(bad).ok());
  EXPECT_FALSE(std::filesystem::exists("/tmp/escaped"));
}

TEST_F(MeshesTravel, ComparedTheySayWhereTheyPart) {
  record(kMostEmbedded);
  Recording other = recording_;
  EXPECT_TRUE(compare(recording_, other).none());
  other.changes[2].values[1] = 0.58;
  other.hashes.push_back({20, 1});
  other.end_hash ^= 1;
  RecordingDifference d = compare(recording_, other);
  EXPECT_TRUE(d.settings.empty());
  EXPECT_EQ(d.first_change, 0);
  EXPECT_EQ(d.change_a, "blade at step 0 (1.1, 0.57, 1, 1.1, 0.57, -1)");
  EXPECT_EQ(d.change_b, "blade at step 0 (1.1, 0.58, 1, 1.1, 0.57, -1)");
  EXPECT_EQ(d.first_hash, -1);
  EXPECT_EQ(d.common_hashes, 1);
  EXPECT_FALSE(d.same_end);
  other = recording_;
  other.changes.pop_back();
  other.source.meshes[0].hash ^= 1;
  other.hashes[0].hash ^= 1;
  d = compare(recording_, other);
  EXPECT_EQ(d.settings.size(), 1u);
  EXPECT_EQ(d.change_a, "end_stroke at step 0");
  EXPECT_EQ(d.change_b, "nothing more");
  EXPECT_EQ(d.first_hash, 0);
}

}  // namespace
}  // namespace kerf::recording_test
