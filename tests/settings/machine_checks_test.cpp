#include "settings/machine_checks.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <string>

#include "support/temporary_folder.h"

namespace mocap::settings {
namespace machine_checks_test {

using ::testing::AllOf;
using ::testing::HasSubstr;
namespace fs = std::filesystem;

class MachineChecks : public testing::Test {
 protected:
  // The faults of a configuration with this text, and with these settings as if they were read from it.
  std::string faults_of(const std::string& text, const DaemonSettings& settings) const {
    const Faults faults = machine_faults(settings, folder_.write("daemon.toml", text));
    return faults.list.empty() ? "" : to_text(faults);
  }

  support::TemporaryFolder folder_;
};

TEST_F(MachineChecks, FindAFolderThatDoesNotExist) {
  DaemonSettings settings;
  settings.record.snapshots = folder_.path() / "takes" / "run.pb";
  settings.record.blobs = folder_.path() / "run.blobs";

  const std::string faults = faults_of("[record]\nsnapshots = \"takes/run.pb\"\nblobs = \"run.blobs\"\n", settings);

  EXPECT_THAT(faults, AllOf(HasSubstr("daemon.toml:2:13: record: snapshots is '"),
                            HasSubstr("does not exist; create it"), HasSubstr("1 fault,")));
}

TEST_F(MachineChecks, AcceptAFolderThatTheDaemonMakesInTheStateFolder) {
  const StateFiles state = state_files(folder_.path());
  DaemonSettings settings;
  settings.record.snapshots = folder_.path() / "takes" / "run.pb";
  folder_.write("daemon.toml", "[record]\nsnapshots = \"takes/run.pb\"\n");

  EXPECT_TRUE(machine_faults(settings, folder_.path() / "daemon.toml", state).list.empty());
  EXPECT_FALSE(machine_faults(settings, folder_.path() / "daemon.toml").list.empty());
}

TEST_F(MachineChecks, FindAFolderThatIsAFile) {
  folder_.write("keep", "");
  DaemonSettings settings;
  settings.subjects.push_back(
      {.name = "anna", .marker_set_file = {}, .file = {}, .keep = folder_.path() / "keep/anna.toml"});

  EXPECT_THAT(faults_of("[[subject]]\nname = \"anna\"\nkeep = \"keep/anna.toml\"\n", settings),
              AllOf(HasSubstr("daemon.toml:3:8: subject 'anna': keep is '"), HasSubstr("is not a folder")));
}

TEST_F(MachineChecks, FindAFolderThatTheUserMayNotWrite) {
  DaemonSettings settings;
  settings.publish.endpoint = "ipc://" + (folder_.path() / "feed").string();
  const std::string text = "[publish]\nendpoint = \"" + settings.publish.endpoint + "\"\n";
  EXPECT_EQ(faults_of(text, settings), "");
  folder_.write("daemon.toml", text);
  constexpr auto kReadOnly = static_cast<fs::perms>(0555);
  fs::permissions(folder_.path(), kReadOnly);
  const bool root = ::geteuid() == 0;
  if (root) {
    ASSERT_EQ(::seteuid(65534), 0);  // nobody: root may write anywhere
  }

  const Faults faults = machine_faults(settings, folder_.path() / "daemon.toml");

  if (root) {
    ASSERT_EQ(::seteuid(0), 0);
  }
  fs::permissions(folder_.path(), fs::perms::owner_all);
  EXPECT_THAT(to_text(faults), HasSubstr("2:12: publish: endpoint is '"));
  EXPECT_THAT(to_text(faults), HasSubstr("this user may not write in the folder '"));
}

TEST_F(MachineChecks, FindAProcessorThatTheMachineDoesNotHave) {
  DaemonSettings settings;
  settings.pipeline.camera.thread.cpus = {0};
  settings.pipeline.fusion.thread.cpus = {0, 1023};

  EXPECT_THAT(faults_of("[realtime]\ncamera_cpus = [0]\nfusion_cpus = [0, 1023]\n", settings),
              AllOf(HasSubstr("3:15: realtime: fusion_cpus has 1023, expected processors of this machine, 0 to "),
                    HasSubstr("1 fault,")));
}

}  // namespace machine_checks_test
}  // namespace mocap::settings
