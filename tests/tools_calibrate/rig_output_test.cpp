#include "calibrate/rig_output.h"

#include <gmock/gmock.h>

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "support/bumped_camera.h"
#include "support/temporary_folder.h"

namespace mocap::calibrate {
namespace rig_output_test {

using ::testing::HasSubstr;

struct Outcome {
  int exit = 0;
  std::string output;
};

class WriteRig : public ::testing::Test {
 protected:
  Outcome write(const Rig& rig) const { return write(rig, path_); }
  Outcome write(const Rig& rig, const std::filesystem::path& path) const {
    ::testing::internal::CaptureStderr();
    ::testing::internal::CaptureStdout();
    Outcome ran;
    ran.exit = write_rig(path, rig, {}, "refine");
    std::fflush(stdout);
    ran.output = ::testing::internal::GetCapturedStderr() + ::testing::internal::GetCapturedStdout();
    return ran;
  }
  static std::string text_of(const std::filesystem::path& path) {
    std::ifstream file(path);
    return {std::istreambuf_iterator<char>(file), {}};
  }
  std::vector<std::filesystem::path> kept() const {
    if (!std::filesystem::exists(folder_.path() / "rigs")) return {};
    return {std::filesystem::directory_iterator(folder_.path() / "rigs"), {}};
  }

  support::TemporaryFolder folder_;
  std::filesystem::path path_ = folder_.path() / "rig.toml";
};

TEST_F(WriteRig, KeepsTheRigThatItReplaces) {
  const Rig rig = test::eight_cameras();
  ASSERT_EQ(write(rig).exit, kExitOk);
  EXPECT_TRUE(kept().empty());
  const std::string before = text_of(path_);
  Rig moved = rig;
  moved[0] = test::bumped(moved[0], 0.01, 0.1);

  const Outcome ran = write(moved);

  EXPECT_EQ(ran.exit, kExitOk) << ran.output;
  ASSERT_EQ(kept().size(), 1U);
  EXPECT_EQ(text_of(kept()[0]), before);
  EXPECT_THAT(ran.output, HasSubstr(kept()[0].string() + ": the rig before"));
  EXPECT_THAT(ran.output, HasSubstr("mocapctl reload"));
  EXPECT_NE(text_of(path_), before);
}

TEST_F(WriteRig, LeavesAFileWithOtherCamerasAloneAndKeepsTheNewRigBesideIt) {
  const Rig all = test::eight_cameras();
  ASSERT_EQ(write(all).exit, kExitOk);
  const std::string before = text_of(path_);
  const Rig some(all.begin(), all.begin() + 7);

  const Outcome ran = write(some);

  EXPECT_EQ(ran.exit, kExitData);
  EXPECT_THAT(ran.output, HasSubstr("'" + all[7].name + "' of '" + path_.string() + "' is not in this recording"));
  EXPECT_EQ(text_of(path_), before);
  ASSERT_EQ(kept().size(), 1U);
  EXPECT_THAT(ran.output, HasSubstr("the new rig is in '" + kept()[0].string()));
  const auto fresh = settings::load_rig(kept()[0]);
  ASSERT_TRUE(fresh);
  EXPECT_EQ(fresh->size(), 7U);
}

TEST_F(WriteRig, LeavesAFileAloneThatIsNoRig) {
  std::ofstream(path_) << "[capture]\nrig = \"rig.toml\"\n";
  const std::string before = text_of(path_);

  const Outcome ran = write(test::eight_cameras());

  EXPECT_EQ(ran.exit, kExitData);
  EXPECT_THAT(ran.output, HasSubstr("cannot be read as a rig file and is not replaced"));
  EXPECT_EQ(text_of(path_), before);
}

TEST_F(WriteRig, EndsWithTheCodeOfAFileThatCannotBeWritten) {
  const Outcome ran = write(test::eight_cameras(), folder_.path() / "missing" / "rig.toml");

  EXPECT_EQ(ran.exit, kExitCannotWrite);
}

TEST_F(WriteRig, IsRefusedBeforehandIfTheRigThatItReplacesCannotBeKept) {
  std::ofstream(folder_.path() / "rigs") << "no folder";
  EXPECT_TRUE(check_rig_output(path_, {})) << "no rig is replaced";
  ASSERT_TRUE(settings::save_rig(path_, test::eight_cameras(), {}));

  const auto checked = check_rig_output(path_, {});

  ASSERT_FALSE(checked);
  EXPECT_EQ(checked.error().exit, kExitCannotWrite);
  EXPECT_THAT(checked.error().message, HasSubstr("rigs' is no folder"));
}

}  // namespace rig_output_test
}  // namespace mocap::calibrate
