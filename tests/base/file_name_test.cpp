#include "base/file_name.h"

#include <gtest/gtest.h>

#include <string>

namespace mocap {
namespace file_name_test {

TEST(FileName, IsOneThatLeadsToNoOtherFolderAndHidesNoFile) {
  for (const std::string name : {"anna", "Anna 2", "_x", "a.b-c"}) {
    EXPECT_TRUE(is_file_name(name)) << name;
  }
  for (const std::string name :
       {"", ".", "..", ".anna", "-rf", " anna", "a/b", "../anna", "a\\b", "a\nb", "an\"na", "\xc3\xa4"}) {
    EXPECT_FALSE(is_file_name(name)) << name;
  }
  EXPECT_TRUE(is_file_name(std::string(64, 'x')));
  EXPECT_FALSE(is_file_name(std::string(65, 'x')));
  EXPECT_FALSE(is_file_name(std::string("a\0b", 3)));
}

}  // namespace file_name_test
}  // namespace mocap
