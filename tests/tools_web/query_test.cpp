#include "web/query.h"

#include <gtest/gtest.h>

namespace mocap::web {
namespace query_test {

TEST(Query, DecodesNamesAndValues) {
  const auto query = read_query("from_s=2.5&name=walk%203&&empty&name=last%2F");

  ASSERT_TRUE(query);
  EXPECT_EQ(query->size(), 3U);
  EXPECT_EQ(query->at("from_s"), "2.5");
  EXPECT_EQ(query->at("name"), "last/");
  EXPECT_EQ(query->at("empty"), "");
}

TEST(Query, RefusesBrokenEscapes) {
  for (const char* broken : {"a=%", "a=%4", "%zz=1", "a=%4g"}) EXPECT_FALSE(read_query(broken)) << broken;
  EXPECT_FALSE(percent_decoded("%2"));
}

TEST(Query, EncodesEveryByte) {
  std::string all;
  for (int i = 0; i < 256; ++i) all += static_cast<char>(i);

  EXPECT_EQ(percent_decoded(percent_encoded(all)), all);
  EXPECT_EQ(percent_encoded("walk 3/ä"), "walk%203%2F%C3%A4");
}

}  // namespace query_test
}  // namespace mocap::web
