#include "kerf/mesh/mesh_file.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <bit>
#include <cmath>
#include <cstring>

#include "kerf/base/random.h"
#include "mesh/temporary_folder.h"
#include "support/source_dir.h"

namespace kerf::mesh_file_test {
namespace {

using test::TemporaryFolder;
using ::testing::HasSubstr;
using ::testing::StartsWith;

std::array<VertexId, 3> tri(int a, int b, int c) { return {VertexId(a), VertexId(b), VertexId(c)}; }

template <class T>
std::string raw(const T& value) {
  return {reinterpret_cast<const char*>(&value), sizeof value};
}
template <class T>
std::string swapped(const T& value) {
  std::string bytes = raw(value);
  return {bytes.rbegin(), bytes.rend()};
}

// Every double that has ever broken a printer, in one mesh.
TriangleMesh awkward_mesh(bool texture, bool groups) {
  TriangleMesh mesh;
  Random random(7);
  const double special[] = {
      -0.0, 5e-324, 1.7976931348623157e308, 0.1, 1.0 / 3, -2.2250738585072014e-308, 9007199254740993.0};
  for (const double s : special) mesh.positions.push_back({s, random.uniform(-1, 1), random.uniform(-1e-9, 1e9)});
  for (int i = 0; i < 200; ++i) {
    mesh.positions.push_back(
        {random.uniform(-1, 1), std::ldexp(random.uniform(), random.index(600) - 300), random.uniform()});
  }
  for (int i = 0; i < 300; ++i) {
    mesh.triangles.push_back(tri(random.index(207), random.index(207), random.index(207)));
    if (texture) {
      std::array<Vec2f, 3> uv;
      for (Vec2f& c : uv) c = {static_cast<float>(random.uniform()), static_cast<float>(random.index(4)) / 3.0f};
      mesh.texture.push_back(uv);
    }
    if (groups) mesh.group.push_back(i < 2 ? i : random.index(2));  // numbered by first appearance
  }
  return mesh;
}

template <class T>
std::string bytes_of(const std::vector<T>& values) {
  std::string bytes;
  for (const T& value : values) bytes += raw(value);
  return bytes;
}

void expect_same_bits(const TriangleMesh& a, const TriangleMesh& b) {
  EXPECT_EQ(bytes_of(a.positions.raw()), bytes_of(b.positions.raw()));
  EXPECT_EQ(a.triangles, b.triangles);
  EXPECT_EQ(bytes_of(a.texture.raw()), bytes_of(b.texture.raw()));
  EXPECT_EQ(a.group, b.group);
}

TEST(MeshFile, ObjAndPlyRoundTripToTheBit) {
  const TemporaryFolder folder;
  for (const bool texture : {false, true}) {
    for (const bool groups : {false, true}) {
      const TriangleMesh mesh = awkward_mesh(texture, groups);
      const std::string obj = folder.file("a.obj");
      const std::string ply = folder.file("a.ply");
      ASSERT_TRUE(write_obj(obj, mesh, {"skin", "cut wall"}).ok());
      ASSERT_TRUE(write_ply(ply, mesh).ok());
      std::vector<std::string> names;
      const auto from_obj = read_mesh(obj, &names);
      const auto from_ply = read_mesh(ply);
      ASSERT_TRUE(from_obj.ok()) << from_obj.error().message;
      ASSERT_TRUE(from_ply.ok()) << from_ply.error().message;
      expect_same_bits(mesh, *from_obj);
      expect_same_bits(mesh, *from_ply);
      EXPECT_EQ(names, groups ? (std::vector<std::string>{"skin", "cut_wall"}) : std::vector<std::string>{});
    }
  }
}

TEST(MeshFile, EqualTextureCoordinatesShareOneLine) {
  const TemporaryFolder folder;
  TriangleMesh mesh;
  mesh.positions.raw() = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  mesh.triangles.raw() = {tri(0, 1, 2), tri(0, 2, 3)};
  mesh.texture.raw() = {{Vec2f{0, 0}, {1, 0}, {1, 1}}, {Vec2f{0, 0}, {1, 1}, {0, 1}}};
  ASSERT_TRUE(write_obj(folder.file("q.obj"), mesh).ok());
  EXPECT_EQ(TemporaryFolder::get(folder.file("q.obj")),
            "# 4 vertices, 2 triangles, metres\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 "
            "1\nvt 0 1\n"
            "f 1/1 2/2 3/3\nf 1/1 3/3 4/4\n");
}

TEST(MeshFile, ObjDialects) {
  const auto mesh = parse_obj(
      "# comment\r\nmtllib x.mtl\r\no thing\r\nv 0 0 0 1.0\r\n  v\t1 +0 0 0.5 0.5 0.5\r\nv 1 1 0 # no\r\nv 0 "
      "1e0 0\r\n"
      "vt 0 0\r\nvt 1 0 0\r\nvt 1 1\r\nvn 0 0 1\r\nusemtl a\r\ns off\r\nf -4/1/1 2/2/-1 3/3/1 -1//1 # a "
      "quad\r\n"
      "usemtl b\r\nf 1//1 2//1 \\\r\n 3//1\r\nusemtl a\r\nf 1 2 4",
      "x.obj");
  ASSERT_TRUE(mesh.ok()) << mesh.error().message;
  EXPECT_EQ(mesh->positions.raw(), (std::vector<Vec3>{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}));
  EXPECT_EQ(mesh->triangles.raw(),
            (std::vector<std::array<VertexId, 3>>{tri(0, 1, 2), tri(0, 2, 3), tri(0, 1, 2), tri(0, 1, 3)}));
  ASSERT_EQ(mesh->texture.size(), 4u);
  EXPECT_EQ(mesh->texture.raw()[0], (std::array<Vec2f, 3>{Vec2f{0, 0}, {1, 0}, {1, 1}}));
  EXPECT_EQ(mesh->texture.raw()[1], (std::array<Vec2f, 3>{Vec2f{0, 0}, {1, 1}, {0, 0}}));
  EXPECT_EQ(mesh->group.raw(), (std::vector<std::int32_t>{0, 0, 1, 0}));
}

TEST(MeshFile, MarkOfUtf8IsSkipped) {
  const TemporaryFolder folder;
  const auto mesh = read_mesh(folder.put("bom.obj", "\xEF\xBB\xBFv 5 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"));
  ASSERT_TRUE(mesh.ok()) << mesh.error().message;
  EXPECT_EQ(mesh->positions.raw()[0].x, 5);
}

TEST(MeshFile, GroupsAreNumberedByFirstAppearance) {
  std::vector<std::string> names;
  const auto mesh = parse_obj("v 0 0 0\nv 1 0 0\nv 0 1 0\ng b\nf 1 2 3\ng  a b \nf 1 2 3\ng b\nf 1 2 3\ng\nf 1 2 3\n",
                              "a.obj", &names);
  ASSERT_TRUE(mesh) << mesh.error().message;
  EXPECT_EQ(mesh->group.raw(), (std::vector<std::int32_t>{0, 1, 0, 2}));
  EXPECT_EQ(names, (std::vector<std::string>{"b", "a b", ""}));
}

// 20 s where a name is looked for among all others.
TEST(MeshFile, AHundredThousandGroups) {
  constexpr int kGroups = 100000;
  std::string text = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
  for (int i = 0; i < 2 * kGroups; ++i) text += fmt::format("g group_{}\nf 1 2 3\n", i % kGroups);
  std::vector<std::string> names;
  const auto mesh = parse_obj(text, "groups.obj", &names);
  ASSERT_TRUE(mesh) << mesh.error().message;
  ASSERT_EQ(names.size(), std::size_t{kGroups});
  EXPECT_EQ(names.back(), "group_99999");
  for (int i = 0; i < 2 * kGroups; ++i) ASSERT_EQ(mesh->group[TriangleId(i)], i % kGroups);
}

// 40 s where a name is compared with all others.
TEST(MeshFile, AHundredThousandProperties) {
  const auto properties = [](int n) {
    std::string out;
    for (int i = 0; i < n; ++i) out += fmt::format("property uchar p{}\n", i);
    return out;
  };
  constexpr int kMany = 100000;
  const std::string start = "ply\nformat ascii 1.0\n";
  const std::string mesh =
      "element vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face 1\n"
      "property list uchar int vertex_indices\nelement other 0\n" +
      properties(kMany) + "end_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
  const auto read = parse_ply(start + mesh, "a.ply");
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->triangles.size(), 1u);
  // Each element has names of its own.
  const std::string twice = start + "element a 0\n" + properties(3) + "element b 0\n" + properties(kMany);
  EXPECT_EQ(parse_ply(twice + "property float p0\n", "a.ply").error().message,
            fmt::format("a.ply:{}: element 'b' has property 'p0' twice; remove one", kMany + 8));
}

TEST(MeshFile, APolygonOf200000CornersInEveryFormat) {
  constexpr int kCorners = 200000;
  std::string obj,
      off = fmt::format("OFF\n{} 1 0\n", kCorners),
      ply = fmt::format(
          "ply\nformat ascii 1.0\nelement vertex {}\nproperty double x\nproperty double y\nproperty double z\n"
          "element face 1\nproperty list int int vertex_indices\nend_header\n",
          kCorners);
  std::string from_one = "f", from_zero = fmt::format("{}", kCorners);
  for (int i = 0; i < kCorners; ++i) {
    const std::string place = fmt::format("{} {} 0\n", i % 1000, i / 1000);
    obj += "v " + place;
    off += place;
    ply += place;
    from_one += fmt::format(" {}", i + 1);
    from_zero += fmt::format(" {}", i);
  }
  for (const auto& mesh : {parse_obj(obj + from_one + "\n", "a.obj"), parse_off(off + from_zero + "\n", "a.off"),
                           parse_ply(ply + from_zero + "\n", "a.ply")}) {
    ASSERT_TRUE(mesh) << mesh.error().message;
    ASSERT_EQ(mesh->triangles.size(), std::size_t{kCorners - 2});
    EXPECT_EQ(mesh->triangles[TriangleId(kCorners - 3)], tri(0, kCorners - 2, kCorners - 1));
  }
}

TEST(MeshFile, ObjFacesMayComeBeforeTheirVertices) {
  const auto mesh = parse_obj("f 1 2 3\nv 0 0 0\nv 1 0 0\nv 0 1 0\n", "x.obj");
  ASSERT_TRUE(mesh.ok()) << mesh.error().message;
  EXPECT_EQ(mesh->triangles.raw()[0], tri(0, 1, 2));
}

struct BrokenFile {
  std::string name;
  std::string bytes;
  std::string place;    ///< what follows the path in the message
  std::string message;  ///< a part of the rest
};

std::string ply_header(const std::string& format, const std::string& vertices, const std::string& faces) {
  return "ply\nformat " + format + " 1.0\nelement vertex " + vertices +
         "\nproperty float x\nproperty float y\nproperty float z\nelement face " + faces +
         "\nproperty list uchar int vertex_indices\nend_header\n";
}

std::string stl_of(std::uint32_t promised, const std::vector<std::array<float, 9>>& triangles,
                   std::string head = "binary") {
  std::string bytes = head;
  bytes.resize(80, ' ');
  bytes += raw(promised);
  for (const auto& t : triangles) bytes += raw(std::array<float, 3>{0, 0, 1}) + raw(t) + std::string(2, '\0');
  return bytes;
}

TEST(MeshFile, BrokenFilesAreRefusedWithTheirPlace) {
  const std::string three = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
  const std::string binary = ply_header("binary_little_endian", "3", "1");
  const std::string nine = raw(std::array<float, 9>{0, 0, 0, 1, 0, 0, 0, 1, 0});
  const std::string face_byte = fmt::format(": byte {}:", binary.size() + 36);
  const std::string off = "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n";
  const std::vector<BrokenFile> files = {
      {"a.obj", three + "f 1 2 4\n", ":4:", "face names vertex 4, but the file has 3"},
      {"a.obj", three + "f 1 2 0\n", ":4:", "count from 1"},
      {"a.obj", three + "f 1 2 -4\n", ":4:", "vertex -4"},
      {"a.obj", three + "f 1 2 99999999999999999999\n", ":4:", "vertex number"},
      {"a.obj", three + "f 1 2 9999999999\n", ":4:", "vertex 9999999999"},
      {"a.obj", three + "\n\nf 1 2\n", ":6:", "at least three corners"},
      {"a.obj", three + "vt 0 0\nf 1/1 2/2 3/1\n", ":5:", "texture coordinate 2, but the file has 1"},
      {"a.obj", three + "f 1x 2 3\n", ":4:", "corner 1 ends in 'x'"},
      {"a.obj", three + "f a b c\n", ":4:", "'a'"},
      {"a.obj", "v 0 0 0\nv 1 nan 0\nv 0 1 0\nf 1 2 3\n",
       ":2:", "vertex 2 has a coordinate that is not a finite number"},
      {"a.obj", "v 0 0 0\nv 1 0 0\nv 0 -inf 0\nf 1 2 3\n", ":3:", "not a finite number"},
      {"a.obj", "v 0 0 0\nv 1 0 0\nv 0 1e999 0\nf 1 2 3\n", ":3:", "not a finite number"},
      {"a.obj", "v 0 0 0\r\nv 1 0\r\nv 0 1 0\r\nf 1 2 3\r\n", ":2:", "needs three numbers"},
      {"a.obj", "v 0 0 0\rv 1 0 x\rv 0 1 0\rf 1 2 3\r", ":2:", "'x'"},
      {"a.obj", three + "vt 0 nan\nf 1/1 2/1 3/1\n", ":4:", "texture coordinate 1 is not a finite number"},
      {"a.obj", three + "vt 0.5 -3.4e38\nf 1/1 2/1 3/1\n", ":4:", "texture coordinate 1 is beyond 1e+09"},
      {"a.ply",
       "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nproperty float u\nproperty float v\n"
       "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0 0 0\n1 0 0 3.4e38 0\n0 1 0 0 1\n3 0 1 2\n",
       ":13:", "vertex 2 has a texture coordinate beyond 1e+09"},
      {"a.ply",
       "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face 1\n"
       "property list uchar int vertex_indices\nproperty list uchar float texcoord\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2 6 0 0 1 0 0 -1e20\n",
       ":14:", "face 1 has a texture coordinate beyond 1e+09"},
      {"a.off", "STOFF\n3 1 0\n0 0 0 0 0\n1 0 0 1e30 0\n0 1 0 0 1\n3 0 1 2\n",
       ":4:", "vertex 2 has a texture coordinate beyond 1e+09"},
      {"a.obj", three, ":", "no faces"},
      {"a.obj", "# nothing\n", ":", "no faces"},
      {"a.obj", "hello world\nv 1\n", ":2:", "needs three numbers"},
      {"a.obj", "\nhello world\n", ":2:", "'hello' is not an OBJ keyword"},
      {"a.obj", "", ":", "the file is empty"},
      {"a.ply", "", ":", "the file is empty"},
      {"a.stl", "", ":", "the file is empty"},
      {"a.off", "", ":", "the file is empty"},
      {"a.obj", off, ":", "the content is OFF; rename it to end in .off"},
      {"a.stl", three + "f 1 2 3\n", ":", "the extension says STL, but the content is OBJ; rename it to end in .obj"},
      {"a.off", stl_of(1, {{0, 0, 0, 1, 0, 0, 0, 1, 0}}), ":", "the content is STL"},
      {"a.obj", binary + nine, ":", "the content is PLY"},
      {"a.ply", "solid a\nfacet normal 0 0 1\n", ":", "the content is STL"},
      {"a.txt", three + "f 1 2 3\n", ":", "looks like OBJ: rename it"},
      {"a.glb", "glTF", ":", "'.glb' is not a mesh format"},
      {"mesh", "x", ":", "no extension"},
      // PLY
      {"a.ply", "plyx\n", ":1:", "begins with the line 'ply'"},
      {"a.ply", "ply\nformat ascii 1.0\nelement vertex 3\n", ":4:", "ends inside its header"},
      {"a.ply", "ply\nformat ascii9 1.0\nend_header\n", ":2:", "'ascii9'"},
      {"a.ply", "ply\nelement vertex -1\nend_header\n", ":2:", "name and a count"},
      {"a.ply", "ply\nproperty float x\n", ":2:", "before the first element"},
      {"a.ply", "ply\nelement vertex 3\nproperty floot x\n", ":3:", "'floot'"},
      {"a.ply", "ply\nelement vertex 3\nproperty float x\nproperty float x\n", ":4:", "'x' twice"},
      {"a.ply", "ply\nelement face 3\nproperty list float int vertex_indices\n", ":3:", "'float'"},
      {"a.ply", "ply\nelement face 3\nproperty list uchar float vertex_indices\n", ":3:", "integer type"},
      {"a.ply", "ply\nelement vertex 1\nproperty float x\nend_header\n1\n", ":4:", "no 'format' line"},
      {"a.ply", "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n1\n", ":", "x, y and z"},
      {"a.ply", "ply\nformat ascii 1.0\nwhat\n", ":3:", "'what'"},
      {"a.ply", "ply\nformat ascii 1.0\nelement tristrips 1\nend_header\n", ":", "triangle strips"},
      {"a.ply", ply_header("ascii", "3", "0") + "0 0 0\n1 0 0\n0 1 0\n", ":", "no faces"},
      {"a.ply", ply_header("ascii", "4294967295", "1") + "0 0 0\n", ":10:", "promises 4294967295 of element 'vertex'"},
      {"a.ply", ply_header("ascii", "3", "4294967295") + "0 0 0\n1 0 0\n0 1 0\n",
       ":13:", "promises 4294967295 of element 'face'"},
      {"a.ply", ply_header("binary_little_endian", "4294967295", "1") + "0 0 0\n",
       ": byte 178:", "promises 4294967295"},
      {"a.ply", ply_header("ascii", "3", "1") + "0 0 0\n1 0 x\n0 1 0\n3 0 1 2\n",
       ":11:", "vertex 2 does not have the values"},
      {"a.ply", ply_header("ascii", "3", "1") + "0 0 0\n1 0 0 0\n0 1 0\n3 0 1 2\n",
       ":11:", "vertex 2 does not have the values"},
      {"a.ply", ply_header("ascii", "3", "1") + "0 0 0\n1 0 0\n0 nan 0\n3 0 1 2\n",
       ":12:", "vertex 3 has a coordinate"},
      {"a.ply", ply_header("ascii", "3", "1") + "0 0 0\n1 0 0\n0 1 0\n3 0 1 3\n", ":13:", "names vertex 3"},
      {"a.ply", ply_header("ascii", "3", "1") + "0 0 0\n1 0 0\n0 1 0\n3 0 1 -1\n", ":13:", "names vertex -1"},
      {"a.ply", ply_header("ascii", "3", "1") + "0 0 0\n1 0 0\n0 1 0\n2 0 1\n", ":13:", "face 1 has 2 corners"},
      {"a.ply", ply_header("ascii", "3", "1") + "0 0 0\n1 0 0\n0 1 0\n4 0 1 2\n", ":13:", "face 1 does not have"},
      {"a.ply", ply_header("ascii", "3", "2") + "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n",
       ":14:", "the file ends in face 2 of 2"},
      {"a.ply", ply_header("ascii", "3", "1") + "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n3 0 1 2\n", ":14:", "more follows"},
      {"a.ply", binary + nine, face_byte, "promises 1 of element 'face'"},
      {"a.ply", binary + nine + "\3" + raw(std::array<std::int32_t, 3>{0, 1, 3}), face_byte, "names vertex 3"},
      {"a.ply", binary + nine + "\4" + raw(std::array<std::int32_t, 3>{0, 1, 2}), face_byte, "the file ends in face 1"},
      {"a.ply", binary + nine + "\3" + raw(std::array<std::int32_t, 3>{0, 1, 2}) + "x",
       fmt::format(": byte {}:", binary.size() + 49), "more follows"},
      {"a.ply",
       binary + raw(std::array<float, 9>{0, 0, 0, std::nanf(""), 0, 0, 0, 1, 0}) + "\3" +
           raw(std::array<std::int32_t, 3>{0, 1, 2}),
       fmt::format(": byte {}:", binary.size() + 12), "vertex 2 has a coordinate"},
      // STL
      {"a.stl", "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 zero\n", ":5:", "'zero'"},
      {"a.stl", "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 inf\n",
       ":5:", "not a finite number"},
      {"a.stl", "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nendloop\n",
       ":6:", "needs 'vertex' here"},
      {"a.stl", "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\n", ":5:", "the file ends in triangle 1"},
      {"a.stl", "solid a\nendsolid a\n", ":", "no triangles"},
      {"a.stl", "short", ":", "too few for an STL file"},
      {"a.stl", stl_of(2, {{0, 0, 0, 1, 0, 0, 0, 1, 0}}), ": byte 80:", "promises 2 triangles, which makes 184 bytes"},
      {"a.stl", stl_of(4294967295u, {{0, 0, 0, 1, 0, 0, 0, 1, 0}}), ": byte 80:", "promises 4294967295"},
      {"a.stl", stl_of(0, {}), ": byte 80:", "no triangles"},
      {"a.stl", stl_of(1, {{0, 0, 0, 1, 0, 0, 0, std::nanf(""), 0}}), ": byte 120:", "not a finite number"},
      // OFF
      {"a.off", "FOO\n", ":1:", "begins with OFF"},
      {"a.off", "4OFF\n", ":1:", "'4OFF'"},
      {"a.off", "OFF BINARY\n", ":1:", "binary OFF"},
      {"a.off", "OFF\n# c\n3\n", ":4:", "ends before the counts"},
      {"a.off", "OFF\n3 x 0\n", ":2:", "'x'"},
      {"a.off", "OFF\n4294967295 1 0\n0 0 0\n", ":3:", "promises 4294967295 vertices"},
      {"a.off", "OFF\n3 4294967295 0\n0 0 0\n1 0 0\n0 1 0\n", ":3:", "4294967295 faces"},
      {"a.off", "OFF\n3 1 0\n0 0 0.00\n1 0\n0 1 0\n3 0 1 2\n", ":4:", "vertex 2 needs three numbers"},
      {"a.off", "OFF\n3 1 0\n0 0 0\n\n1 0 nan\n0 1 0\n3 0 1 2\n", ":5:", "vertex 2 has a coordinate"},
      {"a.off", off + "3 0 1 3\n", ":6:", "names vertex 3"},
      {"a.off", off + "2 0 1 2\n", ":6:", "at least 3"},
      {"a.off", off + "3 0 1 \n", ":6:", "where corner 3 should"},
      {"a.off", off + "3 0 1 2\n\n3 0 1 2\n", ":8:", "more follows"},
      {"a.off", "OFF\n3 0 0\n0 0 0\n1 0 0\n0 1 0\n", ":3:", "no faces"},
  };
  const TemporaryFolder folder;
  for (const BrokenFile& file : files) {
    const std::string path = folder.put(file.name, file.bytes);
    const auto mesh = read_mesh(path);
    ASSERT_FALSE(mesh.ok()) << file.bytes;
    EXPECT_EQ(mesh.error().kind, ErrorKind::kBadInput);
    EXPECT_THAT(mesh.error().message, StartsWith(path + file.place + " ")) << file.bytes;
    EXPECT_THAT(mesh.error().message, HasSubstr(file.message)) << file.bytes;
  }
}

TEST(MeshFile, MissingFilesAndFolders) {
  const TemporaryFolder folder;
  EXPECT_THAT(read_mesh(folder.file("no.obj")).error().message, HasSubstr("no.obj: no such file"));
  std::filesystem::create_directory(folder.file("dir.obj"));
  EXPECT_THAT(read_mesh(folder.file("dir.obj")).error().message, HasSubstr("is a folder"));
  EXPECT_THAT(read_mesh("").error().message, HasSubstr("no file name"));
  EXPECT_THAT(read_mesh("/dev/null").error().message, HasSubstr("not a regular file"));
}

// A unit cube's corner: four triangles, in every format and dialect.
constexpr float kTetrahedron[4][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
constexpr int kTetrahedronFaces[4][3] = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};

std::string ply_tetrahedron(bool big) {
  std::string bytes =
      std::string("ply\r\nformat binary_") + (big ? "big" : "little") +
      "_endian 1.0\r\ncomment hello\r\nobj_info x\r\nelement face 4\r\nproperty uchar red\r\n"
      "property list ushort uint vertex_index\r\nproperty list int double extra\r\nelement vertex 4\r\n"
      "property double z\r\nproperty short quality\r\nproperty float x\r\nproperty list char int8 odd\r\n"
      "property int8 y\r\nproperty float s\r\nproperty float t\r\nelement material 1\r\nproperty float k\r\n"
      "end_header\r\n";
  const auto put = [&](auto value) { bytes += big ? swapped(value) : raw(value); };
  for (const auto& f : kTetrahedronFaces) {
    put(std::uint8_t{7});
    put(std::uint16_t{3});
    for (const int v : f) put(static_cast<std::uint32_t>(v));
    put(std::int32_t{1});
    put(3.5);
  }
  for (const auto& p : kTetrahedron) {
    put(static_cast<double>(p[2]));
    put(std::int16_t{-9});
    put(p[0]);
    put(std::int8_t{2});
    put(std::int8_t{1});
    put(std::int8_t{-1});
    put(static_cast<std::int8_t>(p[1]));
    put(p[0] + 0.25f);
    put(p[1] + 0.5f);
  }
  put(1.0f);
  return bytes;
}

std::string ply_text_tetrahedron() {
  std::string text =
      "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
      "property float texture_u\nproperty float texture_v\nelement face 4\n"
      "property list uchar int vertex_indices\nend_header\n";
  for (const auto& p : kTetrahedron) text += fmt::format("{} {} {} {} {}\n", p[0], p[1], p[2], p[0] + 0.25, p[1] + 0.5);
  for (const auto& f : kTetrahedronFaces) text += fmt::format("3 {} {} {}\n", f[0], f[1], f[2]);
  return text;
}

std::string stl_tetrahedron() {
  std::vector<std::array<float, 9>> triangles;
  for (const auto& f : kTetrahedronFaces) {
    std::array<float, 9> t;
    for (int i = 0; i < 9; ++i) t[static_cast<std::size_t>(i)] = kTetrahedron[f[i / 3]][i % 3];
    triangles.push_back(t);
  }
  return stl_of(4, triangles, "solid but binary all the same");
}

std::string stl_text_tetrahedron() {
  std::string text = "solid my body\n";
  for (const auto& f : kTetrahedronFaces) {
    text += "  FACET NORMAL nan nan nan\n    outer loop\n";
    for (const int v : f)
      text += fmt::format("      vertex {:e} {} {}\n", kTetrahedron[v][0], kTetrahedron[v][1],
                          kTetrahedron[v][2] == 0 ? "-0.0" : "1");
    text += "    endloop\n  endfacet\n";
  }
  return text + "endsolid my body\n";
}

std::string off_tetrahedron() {
  std::string text = "# made by hand\nNOFF # with normals\n\n4 4 6\n# corners\n";
  for (const auto& p : kTetrahedron) text += fmt::format("{} {} {}  0 0 1\n", p[0], p[1], p[2]);
  for (const auto& f : kTetrahedronFaces) text += fmt::format("3 {} {} {} 255 0 0 # red\n", f[0], f[1], f[2]);
  return text;
}

std::string obj_tetrahedron() {
  std::string text;
  for (const auto& p : kTetrahedron)
    text += fmt::format("v {} {} {}\nvt {} {}\n", p[0], p[1], p[2], p[0] + 0.25, p[1] + 0.5);
  for (const auto& f : kTetrahedronFaces)
    text += fmt::format("f {0}/{0} {1}/{1} {2}/{2}\n", f[0] + 1, f[1] + 1, f[2] + 1);
  return text;
}

// The corners of all triangles as points: equal whatever the numbering.
std::vector<std::array<Vec3, 3>> corners_of(const TriangleMesh& mesh) {
  std::vector<std::array<Vec3, 3>> out;
  for (const auto& t : mesh.triangles)
    out.push_back({mesh.positions[t[0]], mesh.positions[t[1]], mesh.positions[t[2]]});
  return out;
}

TEST(MeshFile, AHoleIsRefusedBeforeItIsRead) {
  const TemporaryFolder folder;
  for (const char* name : {"a.obj", "a.ply", "a.off", "a.stl"}) {
    const std::string path = folder.put(name, "v");
    std::filesystem::resize_file(path, std::uintmax_t{1} << 43);
    const auto read = read_mesh(path);
    ASSERT_FALSE(read);
    EXPECT_THAT(read.error().message, StartsWith(path + ": the file has 8.8 TB, a mesh has 4.29 GB at most; give"));
  }
}

TEST(MeshFile, AllFormatsAgreeOnATetrahedron) {
  const TemporaryFolder folder;
  std::vector<std::array<Vec3, 3>> expected;
  for (const auto& f : kTetrahedronFaces) {
    std::array<Vec3, 3> t;
    for (std::size_t i = 0; i < 3; ++i) t[i] = {kTetrahedron[f[i]][0], kTetrahedron[f[i]][1], kTetrahedron[f[i]][2]};
    expected.push_back(t);
  }
  const std::vector<std::pair<std::string, std::string>> files = {
      {"t.obj", obj_tetrahedron()},       {"t.ply", ply_text_tetrahedron()}, {"T.PLY", ply_tetrahedron(false)},
      {"big.ply", ply_tetrahedron(true)}, {"t.stl", stl_tetrahedron()},      {"text.Stl", stl_text_tetrahedron()},
      {"t.off", off_tetrahedron()}};
  for (const auto& [name, bytes] : files) {
    const auto mesh = read_mesh(folder.put(name, bytes));
    ASSERT_TRUE(mesh.ok()) << mesh.error().message;
    EXPECT_EQ(mesh->positions.size(), 4u) << name;
    EXPECT_EQ(corners_of(*mesh), expected) << name;
    const bool textured = name.find("ply") != std::string::npos || name == "T.PLY" || name == "t.obj";
    ASSERT_EQ(mesh->has_texture(), textured) << name;
    for (std::size_t t = 0; textured && t < 4; ++t) {
      for (std::size_t i = 0; i < 3; ++i) {
        const auto& p = kTetrahedron[kTetrahedronFaces[t][i]];
        EXPECT_EQ(mesh->texture.raw()[t][i], (Vec2f{p[0] + 0.25f, p[1] + 0.5f})) << name;
      }
    }
  }
}

// ModelNet's header, faces that go over several lines (Geomview's), corners with texture numbers where there is no texture.
TEST(MeshFile, WhatOthersWriteIsRead) {
  const std::string vertices = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n";
  for (const std::string& text :
       {"OFF4 2 0\n" + vertices + "3 0 1 2\n3 0 2 3\n", "OFF\n4 2 0\n" + vertices + "3 0\n1 2\n3\n0 2\n# c\n3\n",
        "OFF\n4 2 0\n" + vertices + "3 0 1 2 255 0 0\n3 0 2 3 0.5 0.5 1\n"}) {
    const auto off = parse_off(text, "x.off");
    ASSERT_TRUE(off.ok()) << off.error().message;
    EXPECT_EQ(off->positions.size(), 4u);
    ASSERT_EQ(off->triangles.size(), 2u);
    EXPECT_EQ(off->triangles.raw()[1], (std::array<VertexId, 3>{VertexId(0), VertexId(2), VertexId(3)}));
  }
  // The rest of a face is not the face that follows.
  const auto wrong = parse_off("OFF\n4 2 0\n" + vertices + "4 0 1 2\n3 0 2 3\n", "x.off");
  ASSERT_FALSE(wrong.ok());
  EXPECT_THAT(wrong.error().message, HasSubstr("x.off:7: face 1 has 4 corners, but its line has fewer"));

  const auto obj = parse_obj("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1/1 2/2 3/3\n", "x.obj");
  ASSERT_TRUE(obj.ok()) << obj.error().message;
  EXPECT_FALSE(obj->has_texture());
  EXPECT_FALSE(parse_obj("v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nf 1/1 2/2 3/3\n", "x.obj").ok());
}

TEST(MeshFile, OffTextureStandsLast) {
  const auto mesh = parse_off("STOFF\n3 1 0\n0 0 0 0.5 0.25\n1 0 0 1 0\n0 1 0 0 1\n3 0 1 2\n", "x.off");
  ASSERT_TRUE(mesh.ok()) << mesh.error().message;
  EXPECT_EQ(mesh->texture.raw()[0], (std::array<Vec2f, 3>{Vec2f{0.5f, 0.25f}, {1, 0}, {0, 1}}));
}

TEST(MeshFile, TruncationAnywhereNeverCrashes) {
  const std::string big = ply_tetrahedron(true);
  for (std::size_t n = 0; n < big.size(); ++n) EXPECT_FALSE(parse_ply({big.data(), n}, "x").ok()) << n;
  const std::string little = ply_tetrahedron(false);
  for (std::size_t n = 0; n < little.size(); ++n) EXPECT_FALSE(parse_ply({little.data(), n}, "x").ok()) << n;
  const std::string stl = stl_tetrahedron();
  for (std::size_t n = 0; n < stl.size(); ++n) EXPECT_FALSE(parse_stl({stl.data(), n}, "x").ok()) << n;

  // Text may lose its last line break, or characters of a comment, number or name, and still make sense.
  const auto count_good = [](const std::string& text, auto parse) {
    std::size_t good = 0;
    std::size_t first = text.size();
    for (std::size_t n = 0; n <= text.size(); ++n) {
      const std::string copy = text.substr(0, n);  // memory of its own: reading past its end shows in sanitizers
      const std::unique_ptr<char[]> tight(new char[n]);
      std::memcpy(tight.get(), copy.data(), n);
      const Result<TriangleMesh> mesh = parse(std::string_view(tight.get(), n));
      if (!mesh.ok()) {
        EXPECT_FALSE(mesh.error().message.empty());
        continue;
      }
      ++good;
      first = std::min(first, n);
      for (const auto& t : mesh->triangles) {
        for (const VertexId v : t) EXPECT_TRUE(mesh->positions.contains(v));
      }
    }
    return std::pair(good, text.size() - first);
  };
  const auto stl_text = stl_text_tetrahedron();
  const auto [stl_good, stl_early] = count_good(stl_text, [](std::string_view s) { return parse_stl(s, "x"); });
  EXPECT_LE(stl_early, std::string(" my body\n").size());
  EXPECT_EQ(stl_good, stl_early + 1);
  const auto ply_text = ply_text_tetrahedron();
  const auto [ply_good, ply_early] = count_good(ply_text, [](std::string_view s) { return parse_ply(s, "x"); });
  EXPECT_EQ(ply_early, 1u);
  const auto off_text = off_tetrahedron();
  const auto [off_good, off_early] = count_good(off_text, [](std::string_view s) { return parse_off(s, "x"); });
  EXPECT_EQ(off_early, std::string(" 255 0 0 # red\n").size());
  const auto obj_text = obj_tetrahedron();
  const auto [obj_good, obj_early] = count_good(obj_text, [](std::string_view s) { return parse_obj(s, "x"); });
  EXPECT_GT(obj_good, 0u);  // OBJ has no counts: whole lines can go unnoticed
  EXPECT_GT(obj_early, 0u);
}

TEST(MeshFile, RandomBytesNeverCrash) {
  Random random(11);
  const std::string seeds[] = {obj_tetrahedron(), ply_text_tetrahedron(), ply_tetrahedron(true), ply_tetrahedron(false),
                               stl_tetrahedron(), stl_text_tetrahedron(), off_tetrahedron()};
  for (int round = 0; round < 20000; ++round) {
    std::string bytes = seeds[random.index(7)];
    for (int k = 1 + random.index(4); k > 0; --k) {
      const auto at = static_cast<std::size_t>(random.index(static_cast<int>(bytes.size())));
      if (random.index(3) == 0) {
        bytes.erase(at, static_cast<std::size_t>(random.index(9)));
      } else if (random.index(2) == 0) {
        bytes.insert(at, bytes.substr(static_cast<std::size_t>(random.index(static_cast<int>(bytes.size()))), 8));
      } else {
        bytes[at] = static_cast<char>(random.index(256));
      }
      if (bytes.empty()) bytes.push_back('x');
    }
    for (const Result<TriangleMesh>& mesh :
         {parse_obj(bytes, "x"), parse_ply(bytes, "x"), parse_stl(bytes, "x"), parse_off(bytes, "x")}) {
      if (!mesh.ok()) continue;
      ASSERT_FALSE(mesh->triangles.empty());
      for (const Vec3& p : mesh->positions) ASSERT_TRUE(is_finite(p));
      for (const auto& t : mesh->triangles) {
        for (const VertexId v : t) ASSERT_TRUE(mesh->positions.contains(v));
      }
    }
  }
}

TEST(MeshFile, WritingReplacesInOneGo) {
  const TemporaryFolder folder;
  const TriangleMesh mesh = awkward_mesh(true, true);
  const std::string path = folder.put("old.obj", "old");
  TriangleMesh bad = mesh;
  bad.positions.raw()[100].x = std::nan("");
  EXPECT_FALSE(write_obj(path, bad).ok());
  EXPECT_EQ(TemporaryFolder::get(path), "old");  // the old file stays when the new one fails
  EXPECT_FALSE(write_ply(path, bad).ok());
  EXPECT_EQ(TemporaryFolder::get(path), "old");
  bad = mesh;
  bad.triangles.raw()[7][1] = VertexId(207);
  EXPECT_THAT(write_obj(path, bad).error().message, HasSubstr("vertex 207 of 207"));
  bad = mesh;
  bad.texture.resize(3);
  EXPECT_THAT(write_ply(path, bad).error().message, HasSubstr("texture for 3"));
  EXPECT_EQ(TemporaryFolder::get(path), "old");
  ASSERT_TRUE(write_obj(path, mesh).ok());
  EXPECT_TRUE(read_mesh(path).ok());
  const auto entries = std::distance(std::filesystem::directory_iterator(folder.path()), {});
  EXPECT_EQ(entries, 1) << "a temporary file was left behind";

  const Status nowhere = write_obj(folder.file("no/where.obj"), mesh);
  ASSERT_FALSE(nowhere.ok());
  EXPECT_THAT(nowhere.error().message, HasSubstr("/no is not a folder; make it first"));
  std::filesystem::create_directory(folder.file("dir"));
  EXPECT_THAT(write_ply(folder.file("dir"), mesh).error().message, HasSubstr("is a folder"));
  EXPECT_FALSE(write_ply("/dev/full", mesh).ok());  // a full disk, and a device is not renamed over
  EXPECT_TRUE(std::filesystem::is_character_file("/dev/full"));
}

struct SharedMesh {
  const char* name;
  std::size_t vertices, triangles;
};

TEST(MeshFile, SharedMeshes) {
  // Lines that begin with "v " and "f ", counted by another program; all faces are triangles.
  const SharedMesh meshes[] = {{"hook-probe.obj", 2167, 4330},
                               {"medial-meniscus.obj", 1564, 3124},
                               {"medial-meniscus-collision.obj", 105, 160},
                               {"tibia-cartilage.obj", 4453, 8602}};
  const std::string root = test::source_dir() + "/../shared/meshes/";
  if (!std::filesystem::exists(root)) GTEST_SKIP() << "the real meshes are not here: " << root;
  for (const SharedMesh& expected : meshes) {
    const auto mesh = read_mesh(root + expected.name);
    ASSERT_TRUE(mesh.ok()) << mesh.error().message;
    EXPECT_EQ(mesh->positions.size(), expected.vertices) << expected.name;
    EXPECT_EQ(mesh->triangles.size(), expected.triangles) << expected.name;
    EXPECT_FALSE(mesh->has_texture()) << expected.name;
  }
}

}  // namespace
}  // namespace kerf::mesh_file_test
