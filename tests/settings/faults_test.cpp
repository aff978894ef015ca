#include "settings/faults.h"

#include <gtest/gtest.h>

namespace mocap::settings {
namespace faults_test {

TEST(Faults, AreListedByPlaceWithThoseOfOtherFilesLast) {
  const Faults faults{"a.toml",
                      {{"rig.toml", 1, 1, "of the rig"},
                       {"a.toml", 7, 2, "later"},
                       {"a.toml", 7, 1, "earlier in the line"},
                       {"a.toml", 0, 0, "of the whole file"}}};

  EXPECT_EQ(to_text(faults),
            "a.toml: of the whole file\n"
            "a.toml:7:1: earlier in the line\n"
            "a.toml:7:2: later\n"
            "rig.toml:1:1: of the rig\n"
            "a.toml: 4 faults, nothing started");
}

TEST(Faults, AreCountedInWords) {
  EXPECT_EQ(to_text(Faults{"a.toml", {{"a.toml", 1, 1, "wrong"}}}),
            "a.toml:1:1: wrong\na.toml: 1 fault, nothing started");
}

}  // namespace faults_test
}  // namespace mocap::settings
