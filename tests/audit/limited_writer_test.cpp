#include "audit/limited_writer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

namespace mocap::audit {
namespace limited_writer_test {

class List final : public AuditWriter {
 public:
  explicit List(std::vector<std::string>& words) : words_(words) {}
  Status append(const AuditEntry& entry) override {
    words_.push_back(entry.what == "skipped" ? "skipped " + entry.details[0].second : entry.what);
    return {};
  }
  Status sync() override { return {}; }

 private:
  std::vector<std::string>& words_;
};

AuditEntry at(const char* what, double seconds) {
  return {.what = what, .at_utc_ns = static_cast<std::int64_t>((1e9 + seconds) * 1e9)};
}

TEST(LimitedWriter, PassesEveryOrderAndBoundsTheConnections) {
  std::vector<std::string> words;
  LimitedWriter writer(std::make_unique<List>(words));

  for (int i = 0; i < 1000; ++i) {
    ASSERT_TRUE(writer.append(at("refused", 0.0)));
    ASSERT_TRUE(writer.append(at("ordered", 0.0)));
  }

  EXPECT_EQ(std::ranges::count(words, "ordered"), 1000);
  EXPECT_EQ(std::ranges::count(words, "refused"), LimitedWriter::kBurst);
  EXPECT_EQ(std::ranges::count(words, "skipped 1"), 1000 - LimitedWriter::kBurst);
}

TEST(LimitedWriter, CountsWhatItLeftOutAndAdmitsConnectionsAgainWithTime) {
  std::vector<std::string> words;
  LimitedWriter writer(std::make_unique<List>(words));
  for (int i = 0; i < 250; ++i) ASSERT_TRUE(writer.append(at("connected", 0.0)));
  words.clear();

  ASSERT_TRUE(writer.append(at("connected", 1.0)));
  EXPECT_TRUE(words.empty());
  ASSERT_TRUE(writer.append(at("connected", 61.0)));

  EXPECT_EQ(words, (std::vector<std::string>{"skipped 51", "connected"}));
}

TEST(LimitedWriter, SurvivesAClockThatStepsBack) {
  std::vector<std::string> words;
  LimitedWriter writer(std::make_unique<List>(words));
  for (int i = 0; i < 250; ++i) ASSERT_TRUE(writer.append(at("connected", 1000.0)));
  words.clear();

  ASSERT_TRUE(writer.append(at("connected", 0.0)));
  ASSERT_TRUE(writer.append(at("connected", 6.0)));

  EXPECT_EQ(words.back(), "connected");
}

}  // namespace limited_writer_test
}  // namespace mocap::audit
