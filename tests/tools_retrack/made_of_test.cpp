#include "lib/retrack/made_of.h"

#include <gtest/gtest.h>

#include <set>

#include "support/temporary_folder.h"

namespace mocap::retrack {
namespace made_of_test {

TEST(MadeOf, DependsOnTheTakeTheSettingsTheOptionsAndTheVersion) {
  const support::TemporaryFolder folder;
  const auto take = folder.write("one.mcap", "bytes"), copy = folder.write("copy.mcap", "bytes");
  const auto other = folder.write("other.mcap", "bytez");
  const std::vector<TakeFile> files{{.name = "a", .bytes = "b"}}, shifted{{.name = "ab", .bytes = ""}};
  const auto digest = [](const RetrackOrder& order, const std::vector<TakeFile>& settings, const std::string& version) {
    return *made_of(order, settings, version);
  };

  const std::string first = digest({.take = take}, files, "1");
  const std::set<std::string> all{first,
                                  digest({.take = other}, files, "1"),
                                  digest({.take = take}, shifted, "1"),
                                  digest({.take = take}, {}, "1"),
                                  digest({.take = take}, files, "2"),
                                  digest({.take = take, .others = {.settings = "given"}}, files, "1"),
                                  digest({.take = take, .others = {.rig = "given"}}, files, "1"),
                                  digest({.take = take, .others = {.subjects = "given"}}, files, "1"),
                                  digest({.take = take, .from = Duration(1)}, files, "1"),
                                  digest({.take = take, .to = Duration(1)}, files, "1"),
                                  digest({.take = take, .offline = true}, files, "1"),
                                  digest({.take = take, .every_set = true}, files, "1")};

  EXPECT_EQ(first.size(), 64U);
  EXPECT_EQ(all.size(), 12U) << "each differs from each";
  EXPECT_EQ(digest({.take = copy, .out = "elsewhere.mcap", .resume = true}, files, "1"), first);
}

TEST(MadeOf, NeedsTheTake) {
  const auto refused = made_of({.take = "/nowhere/take.mcap"}, {}, "1");

  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::NotFound);
}

}  // namespace made_of_test
}  // namespace mocap::retrack
