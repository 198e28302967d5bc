#include "kerf/base/bytes.h"

#include <gtest/gtest.h>

#include <cmath>
#include <new>

#include "kerf/base/vec.h"

namespace kerf::bytes_test {
namespace {

enum class Colour { kRed, kBlue };
struct Gaps {
  std::uint8_t small = 0;
  double large = 0;
  bool flag = false;
  std::int32_t number = 0;
  friend bool operator==(const Gaps&, const Gaps&) = default;
};
struct Life {
  std::string name;
  std::vector<Vec3> places;
  std::vector<Gaps> gaps;
  std::array<HexId, 2> ends;
  Colour colour = Colour::kRed;
  std::vector<std::vector<NodeId>> nodes;
  std::pair<std::size_t, bool> pair;
  std::array<bool, 2> flags{};
  friend bool operator==(const Life&, const Life&) = default;
};

Life some_life() {
  return {"a life",
          {{1, 2, 3}, {-0.0, 1e-310, 4}},
          {{1, 2.5, true, -7}, {255, -1, false, 9}},
          {HexId(7), HexId()},
          Colour::kBlue,
          {{}, {NodeId(3), NodeId(41)}},
          {12, true},
          {true, false}};
}
std::string written(const Life& life) {
  std::string out;
  ByteWriter{out}(life);
  return out;
}

TEST(Fields, ALonelyMemberAndMany) {
  struct One {
    std::string text;
  };
  static_assert(kFieldCount<One> == 1);
  static_assert(kFieldCount<Vec3> == 3);
  static_assert(kFieldCount<Life> == 8);
  Life life = some_life();
  int visited = 0;
  for_each_field(life, [&visited](auto&) { ++visited; });
  EXPECT_EQ(visited, 8);
}

TEST(Bytes, ComeBackToTheBit) {
  const Life life = some_life();
  const std::string text = written(life);
  ByteReader reader(text);
  Life back;
  reader(back);
  EXPECT_TRUE(reader.ok());
  EXPECT_EQ(reader.left(), 0u);
  EXPECT_EQ(back, life);
  EXPECT_TRUE(std::signbit(back.places[1].x));
  EXPECT_EQ(reader.greatest_id<HexId>(), 7);
  EXPECT_EQ(reader.greatest_id<NodeId>(), 41);
  EXPECT_EQ(reader.greatest_id<CollisionVertex>(), -1);
}

TEST(Bytes, GapsAreLeftOut) {
  // The same values over different rubbish.
  alignas(Gaps) std::array<unsigned char, sizeof(Gaps)> low{}, high{};
  low.fill(0);
  high.fill(0xff);
  std::array<std::string, 2> text;
  for (const auto* memory : {&low, &high}) {
    auto* one = std::launder(reinterpret_cast<Gaps*>(const_cast<unsigned char*>(memory->data())));
    one->small = 1, one->large = 2, one->flag = true, one->number = 3;
    ByteWriter writer(text[memory == &low ? 0 : 1]);
    writer(*one);
  }
  EXPECT_EQ(text[0], text[1]);
  EXPECT_EQ(text[0].size(), 14u);
}

TEST(Bytes, JournaledArraysWithoutTheirLog) {
  Journaled<HexId, Gaps> array;
  array.push_back({1, 2, true, 3});
  (void)array.mark();
  array.set(HexId(0), {9, 9, false, 9});
  std::string text;
  ByteWriter{text}(array);
  ByteReader reader(text);
  Journaled<HexId, Gaps> back;
  reader(back);
  EXPECT_TRUE(reader.ok());
  EXPECT_EQ(back.raw(), array.raw());
}

TEST(Bytes, NoPrefixIsTakenForTheWhole) {
  const std::string text = written(some_life());
  for (std::size_t n = 0; n < text.size(); ++n) {
    ByteReader reader(std::string_view(text).substr(0, n));
    Life back;
    reader(back);
    EXPECT_FALSE(reader.ok()) << n;
  }
}

TEST(Bytes, CountsBeyondTheirBytesAreRefused) {
  for (const std::uint64_t count : {std::uint64_t{3}, std::uint64_t{1} << 40, ~std::uint64_t{0}}) {
    std::string text;
    ByteWriter writer(text);
    writer(count);
    writer(std::array<double, 8>{});
    ByteReader places(text), gaps(text), name(text);
    std::vector<Vec3> three;
    places(three);
    std::vector<Gaps> many;
    gaps(many);
    std::string long_name;
    name(long_name);
    EXPECT_EQ(places.ok(), false) << count;  // 72 bytes for 3 places
    EXPECT_EQ(gaps.ok(), count == 3) << count;
    EXPECT_EQ(name.ok(), count == 3) << count;
    EXPECT_LE(many.capacity(), 64u);
  }
}

TEST(Bytes, ABoolIsZeroOrOne) {
  for (int byte = 0; byte < 256; ++byte) {
    const std::string text(1, static_cast<char>(byte));
    ByteReader reader(text);
    bool flag = false;
    reader(flag);
    EXPECT_EQ(reader.ok(), byte < 2);
    EXPECT_EQ(flag, byte == 1);
  }
}

}  // namespace
}  // namespace kerf::bytes_test
