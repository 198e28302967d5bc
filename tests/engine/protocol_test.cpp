// Messages: what a page sends is decoded or refused, whatever it is; what the engine sends reads back.
#include "kerf/engine/protocol.h"

#include <gtest/gtest.h>

#include "kerf/base/random.h"
#include "page_messages.h"

namespace kerf::protocol::protocol_test {
namespace {

using namespace kerf::test;
using Raw = std::vector<std::byte>;

std::vector<Raw> good_messages() {
  const PageRay ray = ray_between({0.1, -0.2, 0.5}, {0, 0, 0});
  return {page_hello(77, 3, 9),
          page_ack(12),
          page_tool(5, 0, 0, {ray}),
          page_tool(6, 4, 1, {ray, ray, ray}, 3),
          page_tool(7, 1, 3, {}),
          page_tool(11, 10, 0, {ray}, 0, 0.25f),
          page_ray(8, ray, 0.125f),
          page_command(9, 8, {1, 2, 3, 4}, "steak"),
          page_command(10, 6),
          page_claim(true),
          page_upload(1, 0, "body.obj", 4, 20, "v 0 0 0\n"),
          page_upload(1, 2, "s.toml", 0, 0, "")};
}

TEST(Protocol, DecodesWhatThePageMeans) {
  const PageRay ray = ray_between({0.1, -0.2, 0.5}, {0, 0, 0});
  auto hello = decode_page_message(page_hello(0x123456789abcdefull, 3, 9));
  ASSERT_TRUE(hello.ok());
  const auto& h = std::get<PageHello>(*hello);
  EXPECT_EQ(h.session, 0x123456789abcdefull);
  EXPECT_EQ(h.body, 3u);
  EXPECT_EQ(h.version, 9u);

  auto tool = decode_page_message(page_tool(6, 4, 1, {ray, ray}, 3));
  ASSERT_TRUE(tool.ok());
  const auto& t = std::get<ToolInput>(*tool);
  EXPECT_EQ(t.input, 6u);
  EXPECT_EQ(t.tool, Tool::kLine);
  EXPECT_EQ(t.phase, Phase::kMove);
  EXPECT_EQ(t.modifiers, 3u);
  ASSERT_EQ(t.samples.size(), 2u);
  EXPECT_EQ(t.samples[1].ray.origin, (Vec3{0.1, -0.2, 0.5}));
  EXPECT_NEAR(norm(t.samples[1].ray.direction), 1, 1e-15);
  EXPECT_EQ(t.samples[0].pressure, 0.5f);

  auto command = decode_page_message(page_command(9, 8, {1, 2, 3, 4}, "m\xc3\xbcller"));
  ASSERT_TRUE(command.ok());
  const auto& c = std::get<Command>(*command);
  EXPECT_EQ(c.code, CommandCode::kScene);
  EXPECT_EQ(c.text, "m\xc3\xbcller");
  EXPECT_EQ(c.value, (std::array<double, 4>{1, 2, 3, 4}));

  auto upload = decode_page_message(page_upload(1, 1, "a.obj", 4, 20, "v 0 0 0"));
  ASSERT_TRUE(upload.ok());
  const auto& u = std::get<Upload>(*upload);
  EXPECT_EQ(u.part, UploadPart::kCollision);
  EXPECT_EQ(u.name, "a.obj");
  EXPECT_EQ(u.bytes, "v 0 0 0");
}

TEST(Protocol, EveryTruncationIsRefused) {
  for (const Raw& whole : good_messages()) {
    ASSERT_TRUE(decode_page_message(whole).ok());
    for (std::size_t n = 0; n < whole.size(); ++n) {
      Raw cut(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(n));
      EXPECT_FALSE(decode_page_message(cut).ok());
      if (n < 8) continue;
      // The same with a header that fits: the content is what is missing.
      for (std::size_t i = 0; i < 4; ++i) cut[4 + i] = static_cast<std::byte>(n >> (8 * i) & 255);
      EXPECT_FALSE(decode_page_message(cut).ok()) << "type " << static_cast<int>(whole[0]) << " cut to " << n;
    }
    Raw longer = whole;
    longer.resize(whole.size() + 4);
    EXPECT_FALSE(decode_page_message(longer).ok());
    longer[4] = static_cast<std::byte>(longer.size() & 255);
    longer[5] = static_cast<std::byte>(longer.size() >> 8 & 255);
    EXPECT_FALSE(decode_page_message(longer).ok());
  }
}

TEST(Protocol, CountsThatLieAreRefused) {
  for (const Raw& whole : good_messages())
    for (std::size_t at = 8; at + 4 <= whole.size(); at += 4)
      for (const std::uint32_t lie : {0xffffffffu, 0x7fffffffu, 0x04000000u, 0x10000001u}) {
        Raw bad = whole;
        std::memcpy(bad.data() + at, &lie, 4);
        (void)decode_page_message(bad).ok();  // any answer, but no crash and no allocation of gigabytes
      }
  const PageRay ray = ray_between({0, 0, 1}, {0, 0, 0});
  Raw tool = page_tool(1, 0, 0, {ray});
  for (const std::uint32_t n : {0u, 2u, 0x04000001u, 0xffffffffu}) {
    std::memcpy(tool.data() + 24, &n, 4);
    EXPECT_FALSE(decode_page_message(tool).ok()) << n;
  }
  Raw command = page_command(1, 8, {}, "steak");
  for (const std::uint32_t n : {0u, 4u, 9u, 0xfffffffdu, 0xffffffffu}) {
    std::memcpy(command.data() + 16, &n, 4);
    EXPECT_FALSE(decode_page_message(command).ok()) << n;
  }
}

TEST(Protocol, ValuesOutOfRangeAreRefused) {
  const double nan = std::nan(""), inf = HUGE_VAL;
  const auto refused = [](const Raw& bytes) { return !decode_page_message(bytes).ok(); };
  for (const double bad : {nan, inf, -inf, 2e6, -1e300}) {
    EXPECT_TRUE(refused(page_ray(1, {{bad, 0, 0}, {0, 0, 1}})));
    EXPECT_TRUE(refused(page_tool(1, 0, 0, {{{0, bad, 0}, {0, 0, 1}}})));
  }
  for (const double bad : {nan, inf, 0.0, 1e-9, 1e9}) EXPECT_TRUE(refused(page_ray(1, {{0, 0, 0}, {0, 0, bad}})));
  EXPECT_TRUE(refused(page_command(1, 4, {nan})));
  EXPECT_TRUE(refused(page_command(1, 9, {0, 0, inf})));
  EXPECT_TRUE(refused(page_command(1, 0)));
  EXPECT_FALSE(refused(page_device(1, 0, {1, 2, 3}, {0, 3, 0}, 1)));
  for (const double bad : {nan, inf, 2e6}) EXPECT_TRUE(refused(page_device(1, 0, {0, bad, 0}, {}, 1)));
  for (const double bad : {nan, inf, 200.0}) EXPECT_TRUE(refused(page_device(1, 0, {}, {bad, 0, 0}, 1)));
  for (const double bad : {nan, -0.1, 1.1}) EXPECT_TRUE(refused(page_device(1, 0, {}, {}, bad)));
  EXPECT_TRUE(refused(page_command(1, 19)));
  EXPECT_TRUE(refused(page_tool(1, 11, 1, {})));
  EXPECT_TRUE(refused(page_tool(1, 5, 1, {}, 0, -1.0f)));
  EXPECT_TRUE(refused(page_tool(1, 5, 1, {}, 0, NAN)));
  EXPECT_TRUE(refused(page_ray(1, ray_between({0, 0, 1}, {0, 0, 0}), -1.0f)));
  EXPECT_TRUE(refused(page_tool(1, 0, 4, {})));
  EXPECT_TRUE(refused(page_tool(1, 0, 0, {})));  // down needs a sample
  EXPECT_FALSE(refused(page_tool(1, 0, 2, {})));
  EXPECT_TRUE(refused(page_upload(1, 3, "a", 0, 1, "x")));
  EXPECT_TRUE(refused(page_upload(1, 0, "a", 1, 1, "x")));
  EXPECT_TRUE(refused(page_upload(1, 0, "a", 0xffffffff, 0xffffffff, "x")));
  for (const char* text : {"\xff", "\xc0\x80", "\xed\xa0\x80", "a\xc3", "\xf4\x90\x80\x80"})
    EXPECT_TRUE(refused(page_command(1, 8, {}, text)));
  EXPECT_TRUE(refused(page_command(1, 8, {}, std::string("a\0b", 3))));
  EXPECT_TRUE(refused(PageWriter(69).u32(2).u32(0).finish()));
  for (const std::uint16_t type : std::initializer_list<std::uint16_t>{0, 1, 63, 72, 65535})
    EXPECT_TRUE(refused(PageWriter(type).u32(0).u32(0).finish()));
  Raw version = page_ack(1);
  version[2] = std::byte{1};
  EXPECT_TRUE(refused(version));
  EXPECT_TRUE(refused(page_command(1, 8, {}, std::string(70'000, 'a'))));                  // too long
  EXPECT_FALSE(refused(page_upload(1, 0, "a", 0, 1u << 20, std::string(1u << 20, 'a'))));  // a chunk of 1 MiB
  EXPECT_TRUE(refused(page_upload(1, 0, "a", 0, 1u << 22, std::string((1u << 20) + 9000, 'a'))));
}

TEST(Protocol, RandomBytesDoNoHarm) {
  Random random(7);
  const auto below = [&](std::size_t n) { return static_cast<std::size_t>(random.index(static_cast<int>(n))); };
  int decoded = 0;
  const auto good = good_messages();
  for (int i = 0; i < 40'000; ++i) {
    Raw bytes;
    if (i % 2 == 0) {
      bytes.resize(below(200));
      for (std::byte& b : bytes) b = static_cast<std::byte>(below(256));
      if (bytes.size() >= 8) {  // a good header reaches further
        bytes[0] = static_cast<std::byte>(64 + below(7));
        bytes[1] = bytes[3] = bytes[5] = bytes[6] = bytes[7] = std::byte{0};
        bytes[2] = std::byte{1};
        bytes[4] = static_cast<std::byte>(bytes.size());
      }
    } else {
      bytes = good[below(good.size())];
      for (int k = 0; k < 3; ++k) bytes[below(bytes.size())] ^= static_cast<std::byte>(1u << below(8));
    }
    (void)input_of(bytes);
    auto message = decode_page_message(bytes);
    if (!message) {
      EXPECT_FALSE(message.error().message.empty());
      continue;
    }
    ++decoded;
    if (const auto* t = std::get_if<ToolInput>(&*message)) {
      for (const ToolSample& s : t->samples) {
        ASSERT_TRUE(is_finite(s.ray.origin));
        ASSERT_NEAR(norm(s.ray.direction), 1, 1e-9);
      }
    }
    if (const auto* c = std::get_if<Command>(&*message)) {
      for (const double v : c->value) ASSERT_TRUE(std::isfinite(v));
    }
  }
  EXPECT_GT(decoded, 1000);  // the bytes were not all refused at the door
}

TEST(Protocol, EngineMessagesReadBack) {
  const std::vector<Vec3f> rest{{1, 2, 3}, {4, 5, 6}};
  const std::vector<Normal> normal{{1, 2, 3, 0}, {-4, 5, 6, 0}};
  const std::vector<std::uint32_t> copy{0, 0};
  const std::vector<Triangle> skin{{0, 1, 0}}, wall;
  const std::vector<Copy> copies{{0, 1, 0, 1, 0, 1, 0, 1}};
  const std::vector<Cell> cells{{-1, 2, 3, 0}};
  const std::vector<Vec3f> nodes{{7, 8, 9}, {1, 1, std::nanf("")}};
  Body body;
  body.body = 4;
  body.version = 5;
  const std::vector<CellFrame> frames{{{}, 0, {Vec3f{1, 0, 0}, Vec3f{0, 1, 0}, Vec3f{0, 0, 1}}, {1, 2, 3}}};
  body.frames = frames;
  body.rest = rest;
  body.normal = normal;
  body.copy = copy;
  body.skin = skin;
  body.wall = wall;
  body.copies = copies;
  body.cells = cells;
  body.nodes = nodes;
  MirroredPage page;
  page.hear(encode(body));
  EXPECT_EQ(page.body.body, 4u);
  EXPECT_EQ(page.body.rest[1], (F3{4, 5, 6}));
  EXPECT_EQ(page.body.cells[0], (I4{-1, 2, 3, 0}));
  EXPECT_EQ(page.body.nodes[1], (F3{1, 1, 0}));  // nothing that is not finite travels
  page.hear(encode(Hello{9, 2, 0, 60, "abcde", "{\"title\":1}"}));
  EXPECT_EQ(page.name, "abcde");
  EXPECT_EQ(page.json, "{\"title\":1}");
  page.hear(encode(ErrorMessage{3, ErrorCode::kNotAllowed, "no"}));
  EXPECT_EQ(page.errors.at(0).text, "no");
  page.hear(encode(File{1, "a.bin", std::string_view("\0\1\2", 3)}));
  EXPECT_EQ(page.files.at("a.bin").size(), 3u);
  Hit hit;
  hit.triangle = 7;
  hit.point = {1, 2, 3};
  hit.copy = 0;
  page.hear(encode(hit));
  EXPECT_EQ(page.hits.at(0).point[2], 3);
  const std::vector<float> mass{0.25f, 0.125f};
  const std::vector<std::uint32_t> of{1, 0};
  page.hear(encode(Masses{4, 1, 0.5f, mass, of}));
  EXPECT_EQ(page.masses, mass);
  EXPECT_EQ(page.mass_copies, of);
  EXPECT_EQ(page.uncut_mass, 0.5f);
  page.hear(encode(Role{3, 1, 2}));
  EXPECT_TRUE(page.held);
  CutReport cut;
  cut.pieces = 2;
  cut.text = "fine";
  page.hear(encode(cut));
  EXPECT_EQ(page.cuts.at(0).text, "fine");
  Stats stats;
  stats.counts.hexahedra = 11;
  page.hear(encode(stats));
  EXPECT_EQ(page.counts[5], 11u);
}

}  // namespace
}  // namespace kerf::protocol::protocol_test
