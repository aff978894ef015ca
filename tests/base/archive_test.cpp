#include "base/archive.h"

#include <gtest/gtest.h>

#include <vector>

namespace mocap {
namespace archive_test {

enum class Colour { Red, Green };

struct Inner {
  double value = 0.0;
  bool flag = false;

  void archive(Archive& members) { members(value, flag); }
  bool operator==(const Inner&) const = default;
};

struct Outer {
  int number = 0;
  Colour colour = Colour::Red;
  std::vector<Inner> fixed = std::vector<Inner>(2);
  std::vector<float> growing;
  std::vector<bool> flags = std::vector<bool>(3);
  std::optional<Inner> maybe;
  BoundedVector<std::uint16_t, 4> bounded;
  std::array<double, 2> pair{};
  std::pair<int, double> both;

  Outer() { growing.reserve(4); }
  void archive(Archive& members) { members(number, colour, fixed, growing, flags, maybe, bounded, pair, both); }
};

Outer example() {
  Outer one;
  one.number = 7;
  one.colour = Colour::Green;
  one.fixed = {{1.5, true}, {2.5, false}};
  one.growing = {1.0F, 2.0F, 3.0F};
  one.flags = {true, false, true};
  one.maybe = Inner{4.5, true};
  one.bounded.push_back(9);
  one.pair = {5.5, 6.5};
  one.both = {8, 7.5};
  return one;
}

std::vector<std::byte> written(Outer& one) {
  std::vector<std::byte> bytes(1000);
  Archive members = Archive::writer(bytes);
  members(one);
  EXPECT_TRUE(members.ok());
  bytes.resize(members.size());
  return bytes;
}

bool read(const std::vector<std::byte>& bytes, Outer& into) {
  Archive members = Archive::reader(bytes);
  members(into);
  return members.ok();
}

TEST(Archive, ReadsWhatItWrote) {
  Outer one = example(), other;
  other.maybe.reset();

  ASSERT_TRUE(read(written(one), other));

  EXPECT_EQ(other.number, 7);
  EXPECT_EQ(other.colour, Colour::Green);
  EXPECT_EQ(other.fixed, one.fixed);
  EXPECT_EQ(other.growing, one.growing);
  EXPECT_EQ(other.flags, one.flags);
  EXPECT_EQ(other.maybe, one.maybe);
  ASSERT_EQ(other.bounded.size(), 1U);
  EXPECT_EQ(other.bounded[0], 9);
  EXPECT_EQ(other.pair, one.pair);
  EXPECT_EQ(other.both, one.both);
}

TEST(Archive, ReadsAnEmptyOptional) {
  Outer one, other;
  other.maybe = Inner{};

  ASSERT_TRUE(read(written(one), other));

  EXPECT_FALSE(other.maybe.has_value());
}

TEST(Archive, RefusesEveryShorterBelief) {
  Outer one = example();
  std::vector<std::byte> bytes = written(one);
  while (!bytes.empty()) {
    bytes.pop_back();
    Outer other;
    EXPECT_FALSE(read(bytes, other)) << bytes.size();
  }
}

TEST(Archive, RefusesAnotherNumberOfElementsThanAVectorHas) {
  Outer one = example(), other;
  one.fixed.resize(3);

  EXPECT_FALSE(read(written(one), other));
  EXPECT_EQ(other.fixed.size(), 2U);
}

TEST(Archive, RefusesMoreElementsThanTheCapacityOfAnEmptyVector) {
  Outer one = example(), other;
  one.growing.assign(5, 1.0F);

  EXPECT_FALSE(read(written(one), other));
  EXPECT_TRUE(other.growing.empty());
}

TEST(Archive, RefusesAFlagThatIsNeitherTrueNorFalse) {
  Inner one{1.0, true};
  std::vector<std::byte> bytes(100);
  Archive writer = Archive::writer(bytes);
  writer(one);
  bytes[writer.size() - 1] = std::byte{2};

  Archive reader = Archive::reader(bytes);
  reader(one);

  EXPECT_FALSE(reader.ok());
}

TEST(Archive, FailsToWriteWithoutRoom) {
  Outer one = example();
  std::vector<std::byte> bytes(10);
  Archive members = Archive::writer(bytes);

  members(one);

  EXPECT_FALSE(members.ok());
  EXPECT_LE(members.size(), 10U);
}

}  // namespace archive_test
}  // namespace mocap
