// Readers and writers of meshes while memory runs out: every request for memory is refused once, one after the other.
#include <gtest/gtest.h>

#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include "kerf/mesh/mesh_file.h"
#include "kerf/mesh/models.h"
#include "kerf/mesh/whole_file.h"

#include "support/counted_new.h"

namespace kerf::no_memory_test {
namespace {

class NoMemory : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::path(::testing::TempDir()) / ("kerf_no_memory_" + std::to_string(::getpid()));
    std::filesystem::create_directories(folder_);
    const auto made = make_model("strip", {});
    ASSERT_TRUE(made.ok());
    mesh_ = made->visual;
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  [[nodiscard]] std::string file(const std::string& name) const { return (folder_ / name).string(); }
  static std::string text_of(const std::string& path) {
    std::ifstream stream(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), {}};
  }
  [[nodiscard]] std::ptrdiff_t files() const {
    return std::distance(std::filesystem::directory_iterator(folder_), std::filesystem::directory_iterator{});
  }

  std::filesystem::path folder_;
  TriangleMesh mesh_;
};

TEST_F(NoMemory, ReadersSaySoOrReadWhatIsThere) {
  ASSERT_TRUE(write_obj(file("a.obj"), mesh_).ok());
  ASSERT_TRUE(write_ply(file("a.ply"), mesh_).ok());
  std::string stl = "solid a\n", off = "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
  for (int i = 0; i < 20; ++i) {
    const std::string x = std::to_string(i);
    stl += "facet normal 0 0 1\nouter loop\nvertex " + x + " 0 0\nvertex " + x + " 1 0\nvertex 0 " + x +
           " 1\nendloop\nendfacet\n";
  }
  ASSERT_TRUE(replace_file(file("a.stl"), stl + "endsolid a\n").ok());
  ASSERT_TRUE(replace_file(file("a.off"), off).ok());
  for (const char* name : {"a.obj", "a.ply", "a.stl", "a.off"}) {
    const std::string path = file(name);
    const auto whole = read_mesh(path);
    ASSERT_TRUE(whole.ok()) << whole.error().message;
    const long refusals = test::with_requests_refused(
        0, 1,
        [&] {
          const auto read = read_mesh(path);
          if (!read.ok()) return;  // told as an error
          EXPECT_EQ(read->positions.size(), whole->positions.size()) << name;
          EXPECT_EQ(read->triangles.size(), whole->triangles.size()) << name;
        },
        [](bool, bool) {});
    EXPECT_GT(refusals, 3) << name;
  }
}

TEST_F(NoMemory, ASaveLeavesTheOldFileOrTheNew) {
  const std::string path = file("a.obj");
  ASSERT_TRUE(write_obj(path, mesh_).ok());
  const std::string fresh = text_of(path), old = "the old file\n";
  const long refusals = test::with_requests_refused(
      0, 1,
      [&] {
        {
          const test::NothingRefused before;
          ASSERT_TRUE(replace_file(path, old).ok());
        }
        (void)write_obj(path, mesh_);
      },
      [&](bool refused, bool) {
        const std::string now = text_of(path);
        EXPECT_TRUE(now == old || now == fresh);
        if (!refused) {
          EXPECT_EQ(now, fresh);
        }
        EXPECT_EQ(files(), 1) << "something was left beside it";
      });
  EXPECT_GT(refusals, 10);
}

}  // namespace
}  // namespace kerf::no_memory_test
