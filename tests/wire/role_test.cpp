#include "wire/role.h"

#include <gtest/gtest.h>

namespace mocap::wire {
namespace role_test {

TEST(Role, HasTheNameThatTheControlProtocolStates) {
  EXPECT_STREQ(name_of(Role::Viewer), "viewer");
  EXPECT_STREQ(name_of(Role::Operator), "operator");
}

TEST(Role, HasTheRightsOfAViewerIfUnknown) { EXPECT_STREQ(name_of(static_cast<Role>(7)), "viewer"); }

}  // namespace role_test
}  // namespace mocap::wire
