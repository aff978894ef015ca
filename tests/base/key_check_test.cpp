#include "base/key_check.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>

namespace mocap {
namespace key_check_test {

using testing::ElementsAre;
using testing::IsEmpty;

struct Settings {
  double gate = 4.0;
  std::optional<int> width_px;
  std::string clock = "utc";
  std::vector<int> cpus{0};
  std::array<double, 2> place_m{0.0, 1.0};
  std::filesystem::path folder;
};

void declare_keys(KeyVisitor& keys, Settings& settings) {
  keys.number("gate", settings.gate, {1, 10});
  keys.number("width_px", settings.width_px, {16, 16384});
  keys.one_of("clock", settings.clock, {"estimated", "utc"});
  keys.whole_numbers("cpus", settings.cpus, {0, 1023});
  keys.numbers("place_m", settings.place_m, {-10, 10});
  keys.path("folder", settings.folder, {.required = "a folder", .must_exist = true});
}

std::vector<std::string> faults_in(const Settings& settings) {
  std::vector<std::string> messages;
  for (const KeyFault& fault : check_keys(settings)) messages.push_back(fault.key + ": " + fault.message);
  return messages;
}

TEST(KeyCheck, AcceptsValuesWithinTheirRangesAndReadsNoFile) { EXPECT_THAT(faults_in(Settings{}), IsEmpty()); }

TEST(KeyCheck, NamesEachValueOutsideItsRangeOrChoices) {
  Settings settings;
  settings.gate = 0.5;
  settings.width_px = 8;
  settings.clock = "ntp";
  settings.cpus = {0, -1};
  settings.place_m = {0.0, 11.0};

  EXPECT_THAT(faults_in(settings),
              ElementsAre("gate: gate is 0.5, expected 1 to 10",            //
                          "width_px: width_px is 8, expected 16 to 16384",  //
                          "clock: clock is 'ntp', expected one of estimated, utc",
                          "cpus: cpus is -1, expected 0 to 1023", "place_m: place_m is 11, expected -10 to 10"));
}

}  // namespace key_check_test
}  // namespace mocap
