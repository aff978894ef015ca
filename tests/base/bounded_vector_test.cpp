#include "base/bounded_vector.h"

#include <gtest/gtest.h>

#include <string>

namespace mocap {
namespace bounded_vector_test {

using Strings = BoundedVector<std::string, 3>;

Strings of(std::initializer_list<const char*> values) {
  Strings made;
  for (const char* value : values) made.push_back(value);
  return made;
}

TEST(BoundedVector, RefusesAnElementOverItsBoundAndKeepsTheOthers) {
  Strings full = of({"a", "b", "c"});

  EXPECT_FALSE(full.try_push_back("d"));

  EXPECT_EQ(full.size(), 3U);
  EXPECT_EQ(full.back(), "c");
}

TEST(BoundedVector, AssignsToALongerAndToAShorterVector) {
  const Strings two = of({"x", "y"});
  Strings longer = of({"a", "b", "c"});
  Strings shorter = of({"a"});

  longer = two;
  shorter = two;

  EXPECT_TRUE(std::ranges::equal(longer, two));
  EXPECT_TRUE(std::ranges::equal(shorter, two));
}

TEST(BoundedVector, CopiesAreIndependent) {
  const Strings original = of({"a"});
  Strings copy = original;

  copy[0] = "changed";

  EXPECT_EQ(original[0], "a");
}

TEST(BoundedVector, ErasesWithoutOrder) {
  Strings three = of({"a", "b", "c"});

  three.erase_unordered(0);

  EXPECT_TRUE(std::ranges::equal(three, of({"c", "b"})));
}

TEST(BoundedVectorDeathTest, StopsTheProcessOnAnIndexPastTheEnd) {
  const Strings one = of({"a"});

  EXPECT_DEATH(static_cast<void>(one[1]), "violated precondition");
}

}  // namespace bounded_vector_test
}  // namespace mocap
