#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <array>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <string>

#include "settings/daemon_settings.h"
#include "support/loopback_listener.h"
#include "support/places.h"
#include "support/shell.h"
#include "support/temporary_folder.h"

namespace mocap::ctl {
namespace mocapctl_test {

using ::testing::HasSubstr;
namespace fs = std::filesystem;

const fs::path kC3d = fs::path(support::shared_data_folder()) / "c3d";
const fs::path kConfig = fs::path(support::source_folder()) / "config";

struct Ended {
  int exit;
  std::string out;
};

std::string text_of(const fs::path& file) {
  std::ifstream in(file);
  return {std::istreambuf_iterator<char>(in), {}};
}

// `before`: the beginning of the command line.
Ended run(const std::string& arguments, const std::string& before = "") {
  const std::string command =
      before + support::quoted(support::program_folder() + "/mocapctl") + " " + arguments + " 2>&1";
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
  const std::string skeleton = " --skeleton " + support::quoted(kConfig / "skeletons/human18.toml");

  const Ended imported = run("subject import " + support::quoted(kC3d / "pycgm_static_38unlabelled_120.c3d") +
                             " --name anna --static --json --date 2009-07-01 --out " + out + skeleton);
  ASSERT_EQ(imported.exit, 0) << imported.out;
  const auto json = nlohmann::json::parse(imported.out);
  EXPECT_EQ(json["markers"].size(), 39U);
  EXPECT_EQ(json["ghosts"], 38);
  EXPECT_LT(json["residual_mm"], 1.0);
  // The markers of the two forearms differ by 50 mm along the arm. The thigh wands differ only in the forward
  // direction, which does not distinguish left from right.
  const std::vector<std::vector<std::string>> asymmetric{{"LFRM", "RFRM"}};
  EXPECT_EQ(json["asymmetric"], asymmetric);

  std::ofstream(folder.path() / "anna.subject.toml", std::ios::app) << "# my comment\n";
  const std::string again = "subject import " + support::quoted(kC3d / "pycgm_static_38unlabelled_120.c3d") +
                            " --name anna --static --out " + out + skeleton;
  const Ended kept = run(again);
  EXPECT_EQ(kept.exit, 65);
  EXPECT_THAT(kept.out, HasSubstr("exists and is kept"));
  EXPECT_THAT(text_of(folder.path() / "anna.subject.toml"), HasSubstr("# my comment"));
  const Ended replaced = run(again + " --replace");
  EXPECT_EQ(replaced.exit, 0) << replaced.out;
  EXPECT_THAT(text_of(folder.path() / "anna.subject.toml"), ::testing::Not(HasSubstr("# my comment")));

  const std::string fit = "subject fit --c3d " + support::quoted(kC3d / "pycgm_movement_42unlabelled_120.c3d") +
                          " --rest " + support::quoted(kC3d / "pycgm_static_38unlabelled_120.c3d") + " --marker-set " +
                          out + "/anna.markers.toml --out " + out + "/better.toml --name anna";
  folder.write("better.toml", "# my subject");
  const Ended refused = run(fit);
  EXPECT_EQ(refused.exit, 65);
  EXPECT_THAT(refused.out, HasSubstr("better.toml exists and is kept"));
  EXPECT_EQ(text_of(folder.path() / "better.toml"), "# my subject");
  const Ended fitted = run(fit + " --replace");
  ASSERT_EQ(fitted.exit, 0) << fitted.out;
  EXPECT_THAT(fitted.out, HasSubstr("subject anna: 39 markers of anna"));

  const Ended shown = run("subject show --json " + out + "/better.toml");
  ASSERT_EQ(shown.exit, 0) << shown.out;
  const auto subject = nlohmann::json::parse(shown.out);
  EXPECT_LT(subject["residual_mm"], 6.0);
  EXPECT_GT(subject["residual_mm"], 0.5);
}

TEST(Mocapctl, ImportsASubjectWhoseLabelsFollowNoConventionByItsMotion) {
  if (!fs::exists(kC3d)) GTEST_SKIP() << "no shared data at " << support::shared_data_folder();
  const support::TemporaryFolder folder;
  const fs::path out = folder.path();

  const Ended imported = run("subject import " + support::quoted(kC3d / "aml_kneel_to_prone_240.c3d") +
                             " --name eve --date 2026-11-27 --out " + out.string());

  ASSERT_EQ(imported.exit, 0) << imported.out;
  EXPECT_THAT(imported.out, HasSubstr("bones and joints are found in the motion"));
  const Ended shown = run("subject show --json " + (out / "eve.subject.toml").string());
  ASSERT_EQ(shown.exit, 0) << shown.out;
  const auto subject = nlohmann::json::parse(shown.out);
  EXPECT_EQ(subject["markers"].size(), 62U);
  EXPECT_EQ(subject["bones"].size(), 16U);
  EXPECT_LT(subject["residual_mm"], 8.0);

  // The daemon accepts the body.
  std::ofstream(out / "mocapd.toml") << std::ifstream(kConfig / "synthetic.toml").rdbuf()
                                     << "\n[[subject]]\nname = \"eve\"\nfile = \"eve.subject.toml\"\n";
  fs::copy_file(kConfig / "demo.rig.toml", out / "demo.rig.toml");
  const auto settings = settings::load_daemon_settings(out / "mocapd.toml");
  ASSERT_TRUE(settings) << settings::to_text(settings.error());
  EXPECT_EQ(settings->subject_models.size(), 2U);

  const Ended still = run("subject import " + support::quoted(kC3d / "aml_kneel_to_prone_240.c3d") +
                          " --name eve --static --out " + out.string());
  EXPECT_EQ(still.exit, 65);
  EXPECT_THAT(still.out, HasSubstr("import a take in which every joint bends"));
}

TEST(Mocapctl, ReportsInvalidInput) {
  EXPECT_EQ(run("").exit, 64);
  EXPECT_EQ(run("subject fit --marker-set x --out y.toml").exit, 64);
  const Ended no_toml = run("subject fit --c3d x.c3d --marker-set x --out walk.c3d");
  EXPECT_EQ(no_toml.exit, 64);
  EXPECT_THAT(no_toml.out, HasSubstr("--out is 'walk.c3d', expected a subject file FILE.toml"));
  EXPECT_EQ(run("subject import x.c3d --name n --out y --by-motion --skeleton z").exit, 64);
  const Ended missing = run("subject import nothing.c3d --name n --out /tmp --skeleton " +
                            support::quoted(kConfig / "skeletons/human18.toml"));
  EXPECT_EQ(missing.exit, 66);
  EXPECT_THAT(missing.out, HasSubstr("nothing.c3d: cannot be read"));
  const Ended no_subject = run("subject show " + support::quoted(kConfig / "markersets/rigid4.toml"));
  EXPECT_EQ(no_subject.exit, 78);
  EXPECT_THAT(no_subject.out, HasSubstr("format is missing"));
}

TEST(Mocapctl, DescribesOnlyCamerasOfAMakeThatHasFeatures) {
  const std::string config = " --config " + (kConfig / "synthetic.toml").string();

  const Ended synthetic = run("cameras describe cam1" + config);
  const Ended unknown = run("cameras describe nowhere" + config);

  EXPECT_EQ(synthetic.exit, 78);
  EXPECT_THAT(synthetic.out, HasSubstr("cameras with driver synthetic have no features beside their settings"));
  EXPECT_EQ(unknown.exit, 78);
  EXPECT_THAT(unknown.out, HasSubstr("has no camera 'nowhere'"));
}

TEST(Mocapctl, SaysByItsExitCodeWhetherAFileIsMissingOrCannotBeReadOrWritten) {
  const support::TemporaryFolder folder;
  const std::string key = support::quoted(folder.path() / "anna.key");
  ASSERT_EQ(run("keys new " + key).exit, 0);

  EXPECT_EQ(run("keys list --list " + support::quoted(folder.path() / "nothing")).exit, 66);
  EXPECT_EQ(run("keys new " + key).exit, 73);
  EXPECT_EQ(run("keys new /nowhere/anna.key").exit, 73);
  const std::string unreadable = support::quoted(folder.path());  // a folder, which root cannot read either
  EXPECT_EQ(run("subject import " + unreadable + " --name anna --out /tmp").exit, 65);
  EXPECT_EQ(run("cameras shot cam1 --config " + (kConfig / "synthetic.toml").string() + " --out /nowhere/x.png").exit,
            73);
}

TEST(Mocapctl, AllowsNoClientWhoseNameIsNoWord) {
  const support::TemporaryFolder folder;
  const std::string key = support::quoted(folder.path() / "anna.key"), list = support::quoted(folder.path() / "list");
  ASSERT_EQ(run("keys new " + key).exit, 0);

  for (const char* name : {"'anna b'", "'#anna'", "''"}) {
    const Ended refused = run("keys allow " + key + " --list " + list + " --name " + name);
    EXPECT_EQ(refused.exit, 64) << name;
    EXPECT_THAT(refused.out, HasSubstr("expected one word"));
  }
  EXPECT_EQ(run("keys allow " + key + " --list " + list + " --name anna").exit, 0);
}

TEST(Mocapctl, PrintsExamplesInTheHelp) {
  const Ended help = run("--help");
  EXPECT_EQ(help.exit, 0);
  EXPECT_THAT(help.out, HasSubstr("mocapctl subject import static.c3d"));
}

TEST(Mocapctl, DrawsTheShippedMarkerSetsAsTheirReadmeShowsThem) {
  const std::string readme = text_of(kConfig / "markersets" / "README.md");
  std::size_t sets = 0;
  for (const fs::directory_entry& entry : fs::directory_iterator(kConfig / "markersets")) {
    if (entry.path().extension() != ".toml") continue;
    ++sets;
    const std::string name = entry.path().stem().string();

    const Ended drawn = run("subject draw " + entry.path().string());

    EXPECT_EQ(drawn.exit, 0) << drawn.out;
    EXPECT_EQ(drawn.out, text_of(kConfig / "markersets" / "drawings" / (name + ".svg")))
        << "draw it again: mocapctl subject draw config/markersets/" << name
        << ".toml --replace --out config/markersets/drawings/" << name << ".svg";
    EXPECT_THAT(readme, HasSubstr("drawings/" + name + ".svg"));
  }
  EXPECT_GE(sets, 7U);
}

TEST(Mocapctl, DrawsEachMarkerWithItsLabelAndRefusesAnotherFile) {
  support::TemporaryFolder folder;
  const fs::path picture = folder.path() / "set.svg";

  ASSERT_EQ(
      run("subject draw " + (kConfig / "markersets/baseline41.toml").string() + " --out " + picture.string()).exit, 0);

  const std::string svg = text_of(picture);
  for (const char* label : {">HeadTop<", ">LHeel<", ">RToeTip<", ">BackLeft<"}) EXPECT_THAT(svg, HasSubstr(label));
  const std::string again =
      "subject draw " + (kConfig / "markersets/rigid4.toml").string() + " --out " + picture.string();
  const Ended kept = run(again);
  EXPECT_EQ(kept.exit, 65);
  EXPECT_THAT(kept.out, HasSubstr("set.svg exists and is kept; expected another --out, or --replace"));
  EXPECT_EQ(text_of(picture), svg);
  EXPECT_EQ(run(again + " --replace").exit, 0);
  EXPECT_NE(text_of(picture), svg);
  EXPECT_EQ(run("subject draw " + (kConfig / "demo.toml").string()).exit, 78);
  EXPECT_EQ(run("subject draw nothing.toml").exit, 66);
  EXPECT_EQ(run("subject show nothing.toml").exit, 66);
  const Ended nowhere =
      run("subject draw " + (kConfig / "markersets/baseline41.toml").string() + " --out /nowhere/set.svg");
  EXPECT_EQ(nowhere.exit, 73);
  EXPECT_THAT(nowhere.out, HasSubstr("/nowhere/set.svg"));
  EXPECT_THAT(nowhere.out, HasSubstr("No such file or directory"));
}

TEST(Mocapctl, DrawsIntoAPipeAndIntoTheFileBehindALink) {
  const support::TemporaryFolder folder;
  const std::string draw = "subject draw " + (kConfig / "markersets/baseline41.toml").string() + " --out ";
  folder.write("real.svg", "");
  fs::create_symlink("real.svg", folder.path() / "link.svg");

  const Ended piped = run(draw + "/dev/stdout | cat");
  const Ended linked = run(draw + (folder.path() / "link.svg").string() + " --replace");

  EXPECT_THAT(piped.out, HasSubstr(">HeadTop<"));
  EXPECT_EQ(linked.exit, 0) << linked.out;
  EXPECT_TRUE(fs::is_symlink(folder.path() / "link.svg"));
  EXPECT_THAT(text_of(folder.path() / "real.svg"), HasSubstr(">HeadTop<"));
  EXPECT_EQ(run(draw + folder.path().string()).exit, 73);
}

TEST(Mocapctl, DrawsIntoTheFileOfItsStandardOutput) {
  const support::TemporaryFolder folder;
  const fs::path picture = folder.path() / "set.svg";
  const std::string draw = "subject draw " + (kConfig / "markersets/baseline41.toml").string() + " --out /dev/stdout ";

  const Ended first = run(draw + "> " + support::quoted(picture));
  const std::string once = text_of(picture);
  const Ended second = run(draw + ">> " + support::quoted(picture));

  EXPECT_EQ(first.exit, 0) << first.out;
  EXPECT_THAT(once, HasSubstr(">HeadTop<"));
  EXPECT_EQ(second.exit, 0) << second.out;
  EXPECT_EQ(text_of(picture), once + once) << "nothing that was in the file is lost";
}

TEST(Mocapctl, WaitsForALearntMaskAsLongAsIsAsked) {
  // The kernel connects, but nobody answers. Without the option the wait is over a minute.
  const support::LoopbackListener nobody;
  const std::string port = std::to_string(nobody.port());

  const Ended asked = run("mask learn --timeout-s 0.2 --endpoint tcp://127.0.0.1:" + port, "timeout 25 ");

  EXPECT_EQ(asked.exit, 69) << asked.out;  // 124: of timeout
  EXPECT_THAT(run("mask learn --help").out, HasSubstr("default: depends on"));
}

}  // namespace mocapctl_test
}  // namespace mocap::ctl
