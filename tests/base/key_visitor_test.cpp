#include "base/key_visitor.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

namespace mocap {
namespace key_visitor_test {

using testing::ElementsAre;

// Records the key and the value of the last visit, and replaces the value if the test set another one.
class Probe final : public KeyVisitor {
 public:
  Key key;
  std::optional<double> real, real_to;
  std::optional<std::int64_t> whole, whole_to;
  std::string word, word_to;

 protected:
  void visit(const Key& seen, bool& /*field*/) override { key = seen; }
  void visit(const Key& seen, std::optional<double>& value) override {
    key = seen;
    real = value;
    if (real_to) value = real_to;
  }
  void visit(const Key& seen, std::optional<std::int64_t>& value) override {
    key = seen;
    whole = value;
    if (whole_to) value = whole_to;
  }
  void visit(const Key& seen, std::string& field) override {
    key = seen;
    word = field;
    if (!word_to.empty()) field = word_to;
  }
  void visit(const Key& seen, std::filesystem::path& /*field*/) override { key = seen; }
  void visit(const Key& seen, std::vector<int>& /*field*/) override { key = seen; }
  void visit(const Key& seen, std::vector<std::string>& /*field*/) override { key = seen; }
  void visit(const Key& seen, std::span<double> /*fields*/) override { key = seen; }
  void visit(const Key& seen, KeyPairs& /*field*/) override { key = seen; }
};

TEST(KeyVisitor, ReadsTheUnitOfATimeFromTheEndOfItsName) {
  for (const auto& [name, expected] : {std::pair{"window_us", 500.0}, {"window_ms", 0.5}, {"window_s", 0.0005}}) {
    Probe probe;
    Duration window = std::chrono::microseconds(500);

    probe.time(name, window, {0, 1e6});

    EXPECT_DOUBLE_EQ(*probe.real, expected) << name;
    EXPECT_EQ(window, std::chrono::microseconds(500)) << name;
  }
}

TEST(KeyVisitor, FillsATimeInTheUnitOfItsName) {
  Probe probe;
  probe.real_to = 250.0;
  Duration window{};

  probe.time("window_ms", window, {0, 1000});

  EXPECT_EQ(window, std::chrono::milliseconds(250));
}

TEST(KeyVisitor, ConvertsDegreesAndMillimetres) {
  Probe probe;
  double angle_rad = std::numbers::pi / 2.0;
  double length_m = 0.004;

  probe.degrees("angle_deg", angle_rad, {0, 180});
  const std::optional<double> degrees = probe.real;
  probe.real_to = 6.0;
  probe.millimetres("length_mm", length_m, {0, 100});

  EXPECT_DOUBLE_EQ(*degrees, 90.0);
  EXPECT_DOUBLE_EQ(length_m, 0.006);
}

TEST(KeyVisitor, KeepsTheBitsOfAFieldThatNoVisitorChanges) {
  Probe probe;
  const double before = 0.1 + 0.2;  // 0.30000000000000004: a conversion to mm and back changes the last bit
  double length_m = before, angle_rad = before;

  probe.millimetres("length_mm", length_m, {0, 1000});
  probe.degrees("angle_deg", angle_rad, {0, 180});

  EXPECT_EQ(length_m, before);
  EXPECT_EQ(angle_rad, before);
}

TEST(KeyVisitor, LeavesAnAbsentNumberEmpty) {
  Probe probe;
  std::optional<int> width_px;

  probe.number("width_px", width_px, {16, 16384});
  const std::optional<std::int64_t> seen = probe.whole;
  probe.whole_to = 640;
  probe.number("width_px", width_px, {16, 16384});

  EXPECT_EQ(seen, std::nullopt);
  EXPECT_EQ(width_px, 640);
}

TEST(KeyVisitor, PassesAChoiceAsItsWord) {
  enum class Wait { Sleep, Spin };
  Probe probe;
  probe.word_to = "spin";
  Wait wait = Wait::Sleep;

  probe.choice<Wait>("wait", wait, {{"sleep", Wait::Sleep}, {"spin", Wait::Spin}});

  EXPECT_EQ(probe.word, "sleep");
  EXPECT_EQ(wait, Wait::Spin);
  EXPECT_THAT(probe.key.choices, ElementsAre("sleep", "spin"));
  EXPECT_EQ(choices_text(probe.key), "one of sleep, spin");
}

TEST(KeyChoice, EndingInNAcceptsAnyWholeNumber) {
  const Key key{.name = "trigger", .choices = {"free_run", "Line<n>"}};

  for (const char* good : {"free_run", "Line0", "Line12"}) EXPECT_TRUE(is_choice(key, good)) << good;
  for (const char* bad : {"", "free", "Line", "Line<n>", "Line1a", "line1"}) EXPECT_FALSE(is_choice(key, bad)) << bad;
}

TEST(KeyRange, IncludesBothEndsAndExcludesNaN) {
  const KeyRange range{1, 255};

  EXPECT_TRUE(is_within(1, range));
  EXPECT_TRUE(is_within(255, range));
  EXPECT_FALSE(is_within(0.999, range));
  EXPECT_FALSE(is_within(std::numeric_limits<double>::quiet_NaN(), range));
  EXPECT_EQ(range_text(range), "1 to 255");
}

}  // namespace key_visitor_test
}  // namespace mocap
