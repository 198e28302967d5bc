#include "kerf/mesh/glb_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "mesh/temporary_folder.h"
#include "support/source_dir.h"

namespace kerf::glb_file_test {
namespace {

using test::TemporaryFolder;
using ::testing::HasSubstr;
using Triangle = std::array<std::int32_t, 3>;

struct Surface {
  std::vector<Vec3f> positions;
  std::vector<Vec2f> texture;
  std::vector<Triangle> skin, walls;
};

// A strip of n squares, bent by `bend`; with a wall standing on its last edge when `cut`.
Surface strip(int n, float bend, bool cut) {
  Surface s;
  for (int i = 0; i <= n; ++i) {
    for (int j = 0; j < 2; ++j) {
      const float x = static_cast<float>(i) / static_cast<float>(n);
      s.positions.push_back({x, static_cast<float>(j), bend * x * x});
      s.texture.push_back({x, static_cast<float>(j)});
    }
  }
  for (int i = 0; i < n; ++i) {
    s.skin.push_back({2 * i, 2 * i + 2, 2 * i + 3});
    s.skin.push_back({2 * i, 2 * i + 3, 2 * i + 1});
  }
  if (cut) {
    const int v = static_cast<int>(s.positions.size());
    s.positions.push_back({1, 0, bend + 0.5f});
    s.positions.push_back({1, 1, bend + 0.5f});
    s.texture.resize(s.positions.size());
    s.walls = {{2 * n, v, v + 1}, {2 * n, v + 1, 2 * n + 1}};
  }
  return s;
}

Status add(GlbBuilder& builder, double seconds, const Surface& s) {
  const GlbPrimitive primitives[] = {{0, s.skin}, {1, s.walls}};
  return builder.add_frame({seconds, s.positions, {}, s.texture, primitives});
}

GlbBuilder cut_strip() {
  GlbBuilder builder;
  builder.add_material({"skin", {0.8f, 0.3f, 0.2f, 1}, 0, 0.5f, false});
  builder.add_material({"cut", {0.9f, 0.5f, 0.5f, 0.5f}, 0, 0.9f, true});
  EXPECT_TRUE(add(builder, 2.0, strip(4, 0, false)).ok());
  EXPECT_TRUE(add(builder, 2.1, strip(4, 0.1f, false)).ok());
  EXPECT_TRUE(add(builder, 2.2, strip(4, 0.1f, false)).ok());  // nothing moved
  EXPECT_TRUE(add(builder, 2.3, strip(4, 0.2f, true)).ok());   // cut
  EXPECT_TRUE(add(builder, 2.4, strip(4, 0.3f, true)).ok());
  return builder;
}

// A reader of the parts that the tests look at, with the bounds that the format asks for.
struct Glb {
  nlohmann::json json;
  std::string binary;

  explicit Glb(const std::string& path) {
    const std::string bytes = TemporaryFolder::get(path);
    std::uint32_t words[5];
    EXPECT_GE(bytes.size(), sizeof words);
    std::memcpy(words, bytes.data(), sizeof words);
    EXPECT_EQ(bytes.substr(0, 4), "glTF");
    EXPECT_EQ(words[1], 2u);
    EXPECT_EQ(words[2], bytes.size());
    EXPECT_EQ(words[3] % 4, 0u);
    json = nlohmann::json::parse(bytes.substr(20, words[3]), nullptr, false);
    EXPECT_FALSE(json.is_discarded());
    std::uint32_t size = 0;
    std::memcpy(&size, bytes.data() + 20 + words[3], 4);
    binary = bytes.substr(28 + words[3]);
    EXPECT_EQ(binary.size(), size);
  }
  template <class T>
  std::vector<T> accessor(int i) const {
    const auto& a = json["accessors"][static_cast<std::size_t>(i)];
    const auto& view = json["bufferViews"][a["bufferView"].get<std::size_t>()];
    std::vector<T> values(a["count"].get<std::size_t>());
    const auto offset = view["byteOffset"].get<std::size_t>();
    EXPECT_EQ(view["byteLength"].get<std::size_t>(), values.size() * sizeof(T));
    EXPECT_LE(offset + values.size() * sizeof(T), binary.size());
    std::memcpy(values.data(), binary.data() + offset, values.size() * sizeof(T));
    return values;
  }
};

TEST(GlbFile, StatesShareWhatDoesNotChange) {
  const TemporaryFolder folder;
  const GlbBuilder builder = cut_strip();
  EXPECT_EQ(builder.frame_count(), 5u);
  ASSERT_TRUE(builder.write(folder.file("a.glb")).ok());
  const Glb glb(folder.file("a.glb"));
  const auto& meshes = glb.json["meshes"];
  ASSERT_EQ(meshes.size(), 4u);  // the third frame equals the second
  EXPECT_EQ(meshes[0]["primitives"].size(), 1u);
  ASSERT_EQ(meshes[2]["primitives"].size(), 2u);
  const auto& first = meshes[0]["primitives"][0];
  const auto& second = meshes[1]["primitives"][0];
  EXPECT_EQ(first["indices"], second["indices"]);
  EXPECT_EQ(first["attributes"]["TEXCOORD_0"], second["attributes"]["TEXCOORD_0"]);
  EXPECT_NE(first["attributes"]["POSITION"], second["attributes"]["POSITION"]);
  EXPECT_NE(first["attributes"]["TEXCOORD_0"], meshes[2]["primitives"][0]["attributes"]["TEXCOORD_0"]);
  EXPECT_EQ(meshes[2]["primitives"][1]["material"], 1);

  const Surface cut = strip(4, 0.3f, true);
  const auto& last = meshes[3]["primitives"];
  EXPECT_EQ(glb.accessor<Vec3f>(last[0]["attributes"]["POSITION"]), cut.positions);
  const auto walls = glb.accessor<std::uint32_t>(last[1]["indices"]);
  ASSERT_EQ(walls.size(), 6u);
  EXPECT_EQ(std::memcmp(walls.data(), cut.walls.data(), 24), 0);
  const auto uv = glb.accessor<Vec2f>(last[0]["attributes"]["TEXCOORD_0"]);
  EXPECT_EQ(uv[3], (Vec2f{0.25f, 0}));  // v counts from the top
  for (const Vec3f& n : glb.accessor<Vec3f>(last[0]["attributes"]["NORMAL"])) EXPECT_NEAR(norm(to_double(n)), 1, 1e-6);
  const auto flat = glb.accessor<Vec3f>(first["attributes"]["NORMAL"]);
  for (const Vec3f& n : flat) EXPECT_EQ(n, (Vec3f{0, 0, 1}));
}

// Whatever the time, exactly one state is visible, and the right one.
TEST(GlbFile, OneStateIsVisibleAtEveryTime) {
  const TemporaryFolder folder;
  ASSERT_TRUE(cut_strip().write(folder.file("a.glb")).ok());
  const Glb glb(folder.file("a.glb"));
  const auto& animation = glb.json["animations"][0];
  ASSERT_EQ(animation["channels"].size(), 4u);
  const auto visible = [&](float time) {
    std::vector<int> states;
    for (const auto& channel : animation["channels"]) {
      const auto& sampler = animation["samplers"][channel["sampler"].get<std::size_t>()];
      EXPECT_EQ(sampler["interpolation"], "STEP");
      EXPECT_EQ(channel["target"]["path"], "scale");
      const auto times = glb.accessor<float>(sampler["input"]);
      const auto scales = glb.accessor<Vec3f>(sampler["output"]);
      EXPECT_EQ(times.size(), scales.size());
      EXPECT_EQ(times.front(), 0);
      EXPECT_NEAR(times.back(), 0.5, 1e-6);
      std::size_t k = 0;
      while (k + 1 < times.size() && times[k + 1] <= time) ++k;
      if (scales[k].x == 1) states.push_back(channel["target"]["node"].get<int>() - 1);
    }
    return states;
  };
  const float moments[] = {0, 0.05f, 0.15f, 0.25f, 0.35f, 0.45f, 0.5f};
  const int expected[] = {0, 0, 1, 1, 2, 3, 3};
  for (int i = 0; i < 7; ++i) EXPECT_EQ(visible(moments[i]), std::vector<int>{expected[i]}) << moments[i];
}

TEST(GlbFile, RefusedFramesAddNothing) {
  GlbBuilder builder;
  const Surface good = strip(2, 0, true);
  EXPECT_THAT(add(builder, 0, good).error().message, HasSubstr("frame 1: material 0 was not added"));
  builder.add_material({});
  builder.add_material({});
  EXPECT_FALSE(builder.write("/nowhere/a.glb").ok());
  Surface bad = good;
  bad.positions[2].y = NAN;
  EXPECT_THAT(add(builder, 0, bad).error().message, HasSubstr("position 3 is not finite"));
  bad = good;
  bad.skin[1][2] = 99;
  EXPECT_THAT(add(builder, 0, bad).error().message, HasSubstr("vertex 99 of 8"));
  bad = good;
  bad.texture.pop_back();
  EXPECT_THAT(add(builder, 0, bad).error().message, HasSubstr("do not match"));
  bad = good;
  bad.skin.clear();
  bad.walls.clear();
  EXPECT_THAT(add(builder, 0, bad).error().message, HasSubstr("no triangles"));
  EXPECT_THAT(add(builder, std::nan(""), good).error().message, HasSubstr("not later"));
  EXPECT_EQ(builder.frame_count(), 0u);
  ASSERT_TRUE(add(builder, 1, good).ok());
  EXPECT_THAT(add(builder, 1, good).error().message, HasSubstr("frame 2: its time 1 s is not later"));
  EXPECT_EQ(builder.frame_count(), 1u);
  EXPECT_THAT(builder.write("/nowhere/a.glb").error().message, HasSubstr("/nowhere is not a folder"));
}

TEST(GlbFile, KhronosValidatorFindsNothing) {
  const std::string tools = test::source_dir() + "/tests/tools";
  if (std::system("node --version > /dev/null 2>&1") != 0) GTEST_SKIP() << "node is not installed";
  if (!std::filesystem::exists(tools + "/node_modules/gltf-validator")) {
    GTEST_SKIP() << "the validator is not installed; run `npm ci` in tests/tools";
  }
  const TemporaryFolder folder;
  const auto validate = [&](const std::string& name) {
    const std::string log = folder.file("log");
    const std::string command =
        "node '" + tools + "/validate-gltf.mjs' '" + folder.file(name) + "' > '" + log + "' 2>&1";
    EXPECT_EQ(std::system(command.c_str()), 0) << TemporaryFolder::get(log);
  };
  ASSERT_TRUE(cut_strip().write(folder.file("cut.glb")).ok());
  validate("cut.glb");

  GlbBuilder still;  // one frame, no texture, a name that is not UTF-8, a triangle without area, an unused vertex
  still.add_material({"sk\xffin \"<", {2, -1, NAN, 1}, 0, 0.5f, false});
  Surface s = strip(3, 0.2f, false);
  s.positions.push_back({0, 0, 0});
  s.skin.push_back({0, 1, 1});
  const GlbPrimitive primitive{0, s.skin};
  ASSERT_TRUE(still.add_frame({0, s.positions, {}, {}, std::span(&primitive, 1)}).ok());
  ASSERT_TRUE(still.write(folder.file("still.glb")).ok());
  validate("still.glb");

  // The validator does fail on broken files.
  std::string broken = TemporaryFolder::get(folder.file("cut.glb"));
  broken.resize(broken.size() - 4);
  const std::string path = folder.put("broken.glb", broken);
  EXPECT_NE(std::system(("node '" + tools + "/validate-gltf.mjs' '" + path + "' > /dev/null 2>&1").c_str()), 0);
}

}  // namespace
}  // namespace kerf::glb_file_test
