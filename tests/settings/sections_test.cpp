#include "settings/sections.h"

#include <gtest/gtest.h>

#include <set>
#include <string>

#include "base/key_check.h"
#include "settings/key_list.h"

namespace mocap::settings {
namespace sections_test {

TEST(Sections, HaveDefaultsWithinTheirRangesAndRules) {
  DaemonSettings defaults;
  for (const Section& section : sections()) {
    SCOPED_TRACE(section.name);
    KeyCheck check;
    section.declare(check, defaults);

    EXPECT_TRUE(check.faults().empty());
    EXPECT_TRUE(section.faults == nullptr || section.faults(defaults).empty());
  }
}

TEST(Sections, HaveNamesAndKeysThatDiffer) {
  std::set<std::string> names;
  DaemonSettings defaults;
  for (const Section& section : sections()) {
    EXPECT_TRUE(names.insert(section.name).second) << section.name;
    KeyList list;
    section.declare(list, defaults);
    std::set<std::string_view> keys;
    for (const ListedKey& listed : list.entries()) {
      EXPECT_TRUE(keys.insert(listed.key.name).second) << listed.key.name << " in " << section.name;
    }
  }
}

// STYLE: a number carries its unit in its name.
TEST(Sections, NameTheUnitOfEachNumberThatHasOne) {
  const std::set<std::string_view> without{"min_roundness",
                                           "gate_sigmas",
                                           "gate_per_speed",
                                           "confirm_images",
                                           "alpha",
                                           "beta",
                                           "particles",
                                           "seed",
                                           "agree_sigmas",
                                           "min_views_new",
                                           "confirm_sets",
                                           "max_noise_scale",
                                           "least_share",
                                           "max_iterations",
                                           "instants",
                                           "pieces",
                                           "least_gain",
                                           "smoothing_beta",
                                           "max_connections",
                                           "send_queue",
                                           "keep",
                                           "camera_frames",
                                           "side_snapshots",
                                           "publish_snapshots",
                                           "camera_fifo_priority",
                                           "fusion_fifo_priority",
                                           "publish_fifo_priority",
                                           "threshold",
                                           "low_threshold",
                                           "channel",
                                           "xml_ports",
                                           "xsens_ports",
                                           "osc_ports",
                                           "xml_answer_port",
                                           "osc_answer_port",
                                           "camera_cpus",
                                           "fusion_cpus",
                                           "publish_cpus"};
  const std::set<std::string_view> units{"px", "px2", "s", "ms", "us", "mm", "m", "deg", "hz", "s2", "grey", "mb"};
  DaemonSettings defaults;
  for (const Section& section : sections()) {
    KeyList list;
    section.declare(list, defaults);
    for (const ListedKey& listed : list.entries()) {
      const auto& [min, max] = listed.key.range;
      if (min == max || without.contains(listed.key.name)) continue;
      const std::string_view unit = listed.key.name.substr(listed.key.name.rfind('_') + 1);
      EXPECT_TRUE(units.contains(unit)) << listed.key.name << " in " << section.name;
    }
  }
}

}  // namespace sections_test
}  // namespace mocap::settings
