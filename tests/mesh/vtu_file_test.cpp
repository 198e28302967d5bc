#include "kerf/mesh/vtu_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <filesystem>

#include "kerf/base/random.h"
#include "kerf/mesh/base64.h"
#include "mesh/temporary_folder.h"

namespace kerf::vtu_file_test {
namespace {

using test::TemporaryFolder;
using ::testing::HasSubstr;

std::string encoded(const std::string& bytes, std::size_t cut) {
  Base64Encoder encoder;
  std::string text;
  encoder.add(bytes.data(), cut, text);
  encoder.add(bytes.data() + cut, bytes.size() - cut, text);
  encoder.finish(text);
  return text;
}

TEST(Base64, PublishedExamples) {  // RFC 4648, section 10
  const char* examples[][2] = {{"", ""},
                               {"f", "Zg=="},
                               {"fo", "Zm8="},
                               {"foo", "Zm9v"},
                               {"foob", "Zm9vYg=="},
                               {"fooba", "Zm9vYmE="},
                               {"foobar", "Zm9vYmFy"}};
  for (const auto& [bytes, text] : examples) {
    for (std::size_t cut = 0; cut <= std::strlen(bytes); ++cut) EXPECT_EQ(encoded(bytes, cut), text);
  }
}

std::string decoded(const std::string& text) {
  std::string bytes;
  unsigned word = 0;
  int bits = 0;
  for (const char c : text) {
    const char* digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    const char* at = c == '\0' ? nullptr : std::strchr(digits, c);
    if (at == nullptr) continue;
    word = word << 6 | static_cast<unsigned>(at - digits);
    if ((bits += 6) >= 8) bytes += static_cast<char>(word >> (bits -= 8) & 255);
  }
  return bytes;
}

// The values of the array of this name; checks its header.
template <class T>
std::vector<T> array_named(const std::string& xml, const std::string& name, const std::string& type) {
  const std::size_t tag = xml.find("<DataArray type=\"" + type + "\" Name=\"" + name + "\"");
  EXPECT_NE(tag, std::string::npos) << name;
  if (tag == std::string::npos) return {};
  const std::size_t begin = xml.find('>', tag) + 1;
  const std::string bytes = decoded(xml.substr(begin, xml.find('<', begin) - begin));
  std::uint64_t size = 0;
  std::memcpy(&size, bytes.data(), 8);
  EXPECT_EQ(size, bytes.size() - 8);
  std::vector<T> values(size / sizeof(T));
  std::memcpy(values.data(), bytes.data() + 8, size);
  return values;
}

VtuMesh unit_cell() {
  VtuMesh mesh;
  for (int c = 0; c < 8; ++c) mesh.points.push_back({1.0 * (c & 1), 2.0 * (c >> 1 & 1), 3.0 * (c >> 2 & 1)});
  const std::array<std::int32_t, 8> cell = {0, 1, 2, 3, 4, 5, 6, 7};
  add_hexahedra(mesh, std::span(&cell, 1));
  return mesh;
}

TEST(VtuFile, HexahedraFollowVtksOrder) {
  const VtuMesh mesh = unit_cell();
  ASSERT_EQ(mesh.corners.size(), 8u);
  // The rule of VTK's documentation: (0,1,2,3) is the base, counter-clockwise seen from inside along its
  // normal, and (4,5,6,7) the opposite face above it.
  const auto p = [&](std::size_t i) { return mesh.points[static_cast<std::size_t>(mesh.corners[i])]; };
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(p(i + 4) - p(i), (Vec3{0, 0, 3}));
    const Vec3 along = p((i + 1) % 4) - p(i);
    const Vec3 back = p((i + 3) % 4) - p(i);
    EXPECT_EQ(dot(along, back), 0);
    EXPECT_GT(cross(along, back).z, 0);
  }
}

TEST(VtuFile, ArraysHoldWhatWasGiven) {
  const TemporaryFolder folder;
  VtuMesh mesh = unit_cell();
  TriangleMesh surface;
  surface.positions.raw() = {{0.1, -0.0, 1e-300}, {1, 0, 0}, {0, 1, 0}};
  surface.triangles.push_back({VertexId(0), VertexId(1), VertexId(2)});
  add_triangles(mesh, surface);
  Random random(1);
  VtuField velocity{"velocity <m/s>", 3, {}};
  for (int i = 0; i < 33; ++i) velocity.values.push_back(random.uniform(-1, 1));
  mesh.point_fields = {velocity};
  mesh.cell_fields = {{"stiffness", 1, {5000, std::nan("")}}};
  ASSERT_TRUE(write_vtu(folder.file("a.vtu"), mesh).ok());
  const std::string xml = TemporaryFolder::get(folder.file("a.vtu"));
  EXPECT_THAT(xml, HasSubstr("NumberOfPoints=\"11\" NumberOfCells=\"2\""));
  EXPECT_THAT(xml, HasSubstr("header_type=\"UInt64\""));
  EXPECT_EQ(array_named<std::int64_t>(xml, "connectivity", "Int64"),
            (std::vector<std::int64_t>{0, 1, 3, 2, 4, 5, 7, 6, 8, 9, 10}));
  EXPECT_EQ(array_named<std::int64_t>(xml, "offsets", "Int64"), (std::vector<std::int64_t>{8, 11}));
  EXPECT_EQ(array_named<std::uint8_t>(xml, "types", "UInt8"), (std::vector<std::uint8_t>{12, 5}));
  EXPECT_EQ(array_named<double>(xml, "velocity &lt;m/s&gt;", "Float64"), velocity.values);
  const auto points = array_named<double>(xml, "Points", "Float64");
  ASSERT_EQ(points.size(), 33u);
  EXPECT_EQ(std::memcmp(points.data(), mesh.points.data(), 33 * 8), 0);
}

TEST(VtuFile, RefusesWhatDoesNotFit) {
  const TemporaryFolder folder;
  const auto message = [&](const VtuMesh& mesh) {
    const Status status = write_vtu(folder.file("a.vtu"), mesh);
    EXPECT_FALSE(status.ok());
    EXPECT_FALSE(std::filesystem::exists(folder.file("a.vtu")));
    return status.ok() ? "" : status.error().message;
  };
  VtuMesh mesh = unit_cell();
  mesh.corners[3] = 8;
  EXPECT_THAT(message(mesh), HasSubstr("corner 4 names point 8, but there are 8"));
  mesh = unit_cell();
  mesh.corners.pop_back();
  EXPECT_THAT(message(mesh), HasSubstr("1 cells need 8 corners"));
  mesh = unit_cell();
  mesh.points[2].x = std::nan("");
  EXPECT_THAT(message(mesh), HasSubstr("point 3 is not finite"));
  mesh = unit_cell();
  mesh.point_fields = {{"u", 3, std::vector<double>(8)}};
  EXPECT_THAT(message(mesh), HasSubstr("field 'u' has 8 values, but 8 points with 3 components each need 24"));
  mesh = unit_cell();
  mesh.cell_fields = {{"k", 0, {}}};
  EXPECT_THAT(message(mesh), HasSubstr("field 'k'"));
}

TEST(VtuFile, SeriesIsCompleteAfterEveryFrame) {
  const TemporaryFolder folder;
  VtuSeries series(folder.file("run.pvd"));
  ASSERT_TRUE(series.add(0, unit_cell()).ok());
  ASSERT_TRUE(series.add(0.1, unit_cell()).ok());
  EXPECT_EQ(series.frame_count(), 2u);
  EXPECT_FALSE(series.add(0.05, unit_cell()).ok());
  EXPECT_FALSE(series.add(std::nan(""), unit_cell()).ok());
  EXPECT_EQ(TemporaryFolder::get(folder.file("run.pvd")),
            "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"1.0\" "
            "byte_order=\"LittleEndian\">\n<Collection>\n"
            "<DataSet timestep=\"0\" part=\"0\" file=\"run_000000.vtu\"/>\n"
            "<DataSet timestep=\"0.10000000000000001\" part=\"0\" "
            "file=\"run_000001.vtu\"/>\n</Collection>\n</VTKFile>\n");
  EXPECT_TRUE(std::filesystem::exists(folder.file("run_000001.vtu")));
}

TEST(VtuFile, FramesOfASeriesAreKnownByTheirNames) {
  for (const char* name : {"positions_000000.vtu", "positions_1234567.vtu"})
    EXPECT_TRUE(is_series_frame(name, "positions")) << name;
  for (const char* name : {"positions.vtu", "positions_00000.vtu", "positions_00000a.vtu", "positions-000000.vtu",
                           "position_000000.vtu", "positions_000000.vtk"})
    EXPECT_FALSE(is_series_frame(name, "positions")) << name;
}

}  // namespace
}  // namespace kerf::vtu_file_test
