#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <array>
#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "support/places.h"
#include "support/temporary_folder.h"

namespace mocap::ctl {
namespace {

using ::testing::HasSubstr;
namespace fs = std::filesystem;

const fs::path kC3d = fs::path(support::shared_data_folder()) / "c3d";
const fs::path kConfig = fs::path(support::source_folder()) / "config";

struct Ended {
  int exit;
  std::string out;
};

Ended run(const std::string& arguments) {
  const std::string command = support::program_folder() + "/mocapctl " + arguments + " 2>&1";
  FILE* pipe = ::popen(command.c_str(), "r");
  Ended ended{-1, {}};
  std::array<char, 4096> block;
  for (std::size_t count; (count = std::fread(block.data(), 1, block.size(), pipe)) > 0;)
    ended.out.append(block.data(), count);
  ended.exit = WEXITSTATUS(::pclose(pipe));
  return ended;
}

TEST(Mocapctl, ImportsFitsAndShowsARecordedSubject) {
  if (!fs::exists(kC3d)) GTEST_SKIP() << "no shared data at " << support::shared_data_folder();
  const support::TemporaryFolder folder;
  const std::string out = folder.path().string();
  const std::string skeleton = " --skeleton " + (kConfig / "skeletons/human18.toml").string();

  const Ended imported = run("subject import " + (kC3d / "pycgm_static_38unlabelled_120.c3d").string() +
                             " --name anna --static --json --date 2009-07-01 --out " + out + skeleton);
  ASSERT_EQ(imported.exit, 0) << imported.out;
  const auto json = nlohmann::json::parse(imported.out);
  EXPECT_EQ(json["markers"].size(), 39U);
  EXPECT_EQ(json["ghosts"], 38);
  EXPECT_LT(json["residual_mm"], 1.0);
  // The forearms' markers sit 50 mm apart along them; its thigh wands differ to the fore only, which tells no side.
  const std::vector<std::vector<std::string>> asymmetric{{"LFRM", "RFRM"}};
  EXPECT_EQ(json["asymmetric"], asymmetric);

  const Ended fitted = run("subject fit --c3d " + (kC3d / "pycgm_movement_42unlabelled_120.c3d").string() + " --rest " +
                           (kC3d / "pycgm_static_38unlabelled_120.c3d").string() + " --marker-set " + out +
                           "/anna.markers.toml --out " + out + "/better.toml --name anna");
  ASSERT_EQ(fitted.exit, 0) << fitted.out;
  EXPECT_THAT(fitted.out, HasSubstr("subject anna: 39 markers of anna"));

  const Ended shown = run("subject show --json " + out + "/better.toml");
  ASSERT_EQ(shown.exit, 0) << shown.out;
  const auto subject = nlohmann::json::parse(shown.out);
  EXPECT_LT(subject["residual_mm"], 6.0);
  EXPECT_GT(subject["residual_mm"], 0.5);
}

TEST(Mocapctl, SaysWhatIsWrong) {
  EXPECT_EQ(run("").exit, 64);
  EXPECT_EQ(run("subject fit --marker-set x --out y").exit, 64);
  const Ended missing =
      run("subject import nothing.c3d --name n --out /tmp --skeleton " + (kConfig / "skeletons/human18.toml").string());
  EXPECT_EQ(missing.exit, 65);
  EXPECT_THAT(missing.out, HasSubstr("nothing.c3d: cannot be read"));
  const Ended no_subject = run("subject show " + (kConfig / "markersets/rigid4.toml").string());
  EXPECT_EQ(no_subject.exit, 78);
  EXPECT_THAT(no_subject.out, HasSubstr("format is missing"));
}

TEST(Mocapctl, HelpsWithExamples) {
  const Ended help = run("--help");
  EXPECT_EQ(help.exit, 0);
  EXPECT_THAT(help.out, HasSubstr("mocapctl subject import static.c3d"));
}

}  // namespace
}  // namespace mocap::ctl
