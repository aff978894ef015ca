#include "take/recordings/record_settings.h"

#include <gtest/gtest.h>

#include "base/key_check.h"

namespace mocap::take {
namespace record_settings_test {

TEST(RecordSettings, HaveDefaultsWithinTheirRanges) {
  const RecordSettings defaults;

  EXPECT_TRUE(check_keys(defaults).empty());
}

TEST(RecordSettings, RejectAnotherFileExtension) {
  EXPECT_TRUE(faults_of(RecordSettings{}).empty());
  EXPECT_TRUE(faults_of(RecordSettings{.snapshots = "run.jsonl", .blobs = "run.blobs"}).empty());
  EXPECT_TRUE(faults_of(RecordSettings{.snapshots = "run.pb", .blobs = {}}).empty());

  const std::vector<KeyFault> faults = faults_of(RecordSettings{.snapshots = "run.csv", .blobs = "run.pb"});

  ASSERT_EQ(faults.size(), 2U);
  EXPECT_EQ(faults[0].message, "snapshots is 'run.csv', expected a file name that ends in .jsonl or .pb");
  EXPECT_EQ(faults[1].message, "blobs is 'run.pb', expected a file name that ends in .blobs");
}

}  // namespace record_settings_test
}  // namespace mocap::take
