#include "settings/toml/toml_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>

#include "support/temporary_folder.h"

namespace mocap::settings {
namespace toml_file_test {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

class Toml : public testing::Test {
 protected:
  TomlTable open(const std::string& text) {
    Result<TomlFile, Faults> file = TomlFile::open(folder_.write("a.toml", text));
    EXPECT_TRUE(file) << to_text(file.error());
    file_.emplace(*std::move(file));
    return file_->root();
  }

  /// "line:column: message" of each fault.
  std::vector<std::string> faults() const {
    std::vector<std::string> texts;
    for (const Fault& fault : file_->faults().list) {
      texts.push_back(to_text({"", fault.line, fault.column, fault.message}).substr(1));
    }
    return texts;
  }

  support::TemporaryFolder folder_;
  std::optional<TomlFile> file_;
};

TEST_F(Toml, FillsAFieldOfEachKind) {
  TomlTable table = open(
      "flag = true\nreal = 1\nwhole = 7\nword = \"b\"\npath = \"c/../d.toml\"\nlist = [1, 2]\ntexts = [\"x\"]\n"
      "point = [1, 2.5]\npairs = { B = 1, A = \"on\" }\n");
  bool flag = false;
  double real = 0.0;
  std::optional<int> whole;
  std::string word = "a";
  std::filesystem::path path;
  std::vector<int> list;
  std::vector<std::string> texts;
  std::array<double, 2> point{};
  KeyPairs pairs;

  table.flag("flag", flag);
  table.number("real", real, {0, 10});
  table.number("whole", whole, {0, 10});
  table.one_of("word", word, {"a", "b"});
  table.path("path", path);
  table.whole_numbers("list", list, {0, 10});
  table.texts("texts", texts);
  table.numbers("point", point, {-10, 10});
  table.pairs("pairs", pairs);
  table.done();

  EXPECT_THAT(faults(), IsEmpty());
  EXPECT_TRUE(flag);
  EXPECT_EQ(real, 1.0);
  EXPECT_EQ(whole, 7);
  EXPECT_EQ(word, "b");
  EXPECT_EQ(path, folder_.path() / "d.toml") << "relative to the file";
  EXPECT_THAT(list, ElementsAre(1, 2));
  EXPECT_THAT(texts, ElementsAre("x"));
  EXPECT_THAT(point, ElementsAre(1.0, 2.5));
  EXPECT_EQ(pairs, (KeyPairs{{"B", "1"}, {"A", "on"}})) << "in the order of the file";
}

TEST_F(Toml, KeepsTheDefaultOfAnAbsentKey) {
  TomlTable table = open("");
  double real = 3.0;
  std::string word = "a";

  table.number("real", real, {0, 10});
  table.one_of("word", word, {"a", "b"});

  EXPECT_THAT(faults(), IsEmpty());
  EXPECT_EQ(real, 3.0);
  EXPECT_EQ(word, "a");
}

TEST_F(Toml, KeepsTheDefaultOfAWrongValueAndNamesPlaceValueAndExpectation) {
  TomlTable table = open("real = 11\nwhole = 1.5\nword = \"bb\"\nflag = 1\n");
  double real = 3.0;
  int whole = 3;
  std::string word = "a";
  bool flag = true;

  table.number("real", real, {0, 10});
  table.number("whole", whole, {0, 10});
  table.one_of("word", word, {"a", "bbb"});
  table.flag("flag", flag);

  EXPECT_THAT(faults(), ElementsAre("1:8: real is 11, expected 0 to 10",                               //
                                    "2:9: whole is 1.5, expected a whole number, 0 to 10",             //
                                    "3:8: word is 'bb', expected one of a, bbb; did you mean 'bbb'?",  //
                                    "4:8: flag is 1, expected true or false"));
  EXPECT_EQ(real, 3.0);
  EXPECT_EQ(whole, 3);
  EXPECT_EQ(word, "a");
  EXPECT_TRUE(flag);
}

TEST_F(Toml, ReadsTheFormerNameOfAKey) {
  TomlTable table = open("max_old = 7\npoint_old = [1, 2]\n");
  double most = 3.0;
  std::array<double, 2> point{};

  table.number("max_new", most, {0, 10}, {.required = "the maximum", .formerly = "max_old"});
  table.numbers("point", point, {0, 10}, {.formerly = "point_old"});
  table.done();

  EXPECT_THAT(faults(), IsEmpty());
  EXPECT_EQ(most, 7.0);
  EXPECT_THAT(point, ElementsAre(1.0, 2.0));
}

TEST_F(Toml, RefusesAKeyWithBothItsNames) {
  TomlTable table = open("max_old = 7\nmax_new = 8\n");
  double most = 3.0;

  table.number("max_new", most, {0, 10}, {.formerly = "max_old"});
  table.done();

  EXPECT_THAT(faults(), ElementsAre("1:11: max_old is the former name of max_new, expected one of them"));
}

TEST_F(Toml, NamesThePlaceOfAWrongValueOfAFormerName) {
  TomlTable table = open("max_old = 11\npoint_old = [1, 12]\n");
  double most = 3.0;
  std::array<double, 2> point{};

  table.number("max_new", most, {0, 10}, {.formerly = "max_old"});
  table.numbers("point", point, {0, 10}, {.formerly = "point_old"});

  EXPECT_THAT(faults(), ElementsAre("1:11: max_new is 11, expected 0 to 10",  //
                                    "2:13: point has 12, expected 0 to 10"));
}

TEST_F(Toml, KnowsNoFormerNameOfAnotherKey) {
  TomlTable table = open("max_old = 7\n");
  double most = 3.0;

  table.number("least", most, {0, 10}, {.formerly = "least_old"});
  table.done();

  EXPECT_THAT(faults(), ElementsAre("1:1: unknown key 'max_old'; known are least"));
}

TEST_F(Toml, MissesARequiredKey) {
  TomlTable table = open("");
  std::string name;

  table.text("name", name, {.required = "the name of the camera"});

  EXPECT_THAT(faults(), ElementsAre("1:1: name is missing, expected the name of the camera"));
}

TEST_F(Toml, NamesAMisspeltRequiredKeyInsteadOfAMissingOne) {
  TomlTable table = open("\nnam = \"west\"\nplace = 1\n");
  std::string name, site;

  table.text("name", name, {.required = "the name of the camera"});
  table.text("site", site, {.required = "the site of the camera"});
  table.done();

  EXPECT_THAT(faults(), ElementsAre("1:1: site is missing, expected the site of the camera",
                                    "2:1: unknown key 'nam', did you mean 'name'? Expected the name of the camera",
                                    "3:1: unknown key 'place'; known are name, site"));
}

TEST_F(Toml, NamesAMisspeltKeyOnceIfItIsRequiredLater) {
  TomlTable table = open("marker_sett = \"a.toml\"\n");
  std::string set;
  table.text("marker_set", set);

  table.done();

  EXPECT_FALSE(table.require("marker_set", "a file"));
  EXPECT_THAT(faults(), ElementsAre("1:1: unknown key 'marker_sett', did you mean 'marker_set'?"));
}

TEST_F(Toml, ExplainsHeadingsWithTheWrongNumberOfBrackets) {
  TomlTable root = open("[camera]\nname = \"west\"\n[[capture]]\nrig = \"r\"\n");

  EXPECT_TRUE(root.tables("camera", "camera").empty());
  EXPECT_FALSE(root.table("capture", "capture"));

  EXPECT_THAT(faults(),
              ElementsAre("1:1: [camera] has one bracket, expected [[camera]]: one such table for each camera",
                          "3:1: [[capture]] has two brackets, expected [capture]: this section exists once"));
}

TEST_F(Toml, LooksForAPathThatMustExist) {
  TomlTable table = open("here = \".\"\nnowhere = \"none\"\n");
  std::filesystem::path here, nowhere;

  table.path("here", here, {.must_exist = true});
  table.path("nowhere", nowhere, {.must_exist = true});

  EXPECT_THAT(faults(), ElementsAre(HasSubstr("2:11: nowhere is '")));
}

TEST_F(Toml, LeavesARuleOutWhoseKeyHasAFaultAlready) {
  TomlTable table = open("first = \"x\"\nsecond = 2\n");
  double first = 0.0, second = 0.0;
  table.number("first", first, {0, 10});
  table.number("second", second, {0, 10});

  table.add({{"first", "first is too small"}, {"second", "second is too large"}, {"", "both are wrong"}});

  EXPECT_THAT(faults(), ElementsAre("1:9: first is 'x', expected a number, 0 to 10", "2:10: second is too large",
                                    HasSubstr("both are wrong")));
}

TEST_F(Toml, NamesTheTableInItsFaults) {
  TomlTable root = open("[[camera]]\nname = \"west\"\nrate = 1\n");
  TomlTable camera = root.tables("camera", "camera").at(0);

  camera.call_by("name", "camera");
  camera.done();

  EXPECT_THAT(faults(), ElementsAre("3:1: camera 'west': unknown key 'rate'; known are name"));
}

TEST_F(Toml, SuggestsTheKeyThatWasProbablyMeant) {
  TomlTable table = open("treshold = 1\n");
  double threshold = 0.0;
  table.number("threshold", threshold, {0, 255});

  table.done();

  EXPECT_THAT(faults(), ElementsAre("1:1: unknown key 'treshold', did you mean 'threshold'?"));
}

TEST_F(Toml, ReadsListsMatricesAndPolygons) {
  TomlTable table = open(
      "list = [1, 2, 3]\nmatrix = [[1, 2], [3, 4]]\nmask = [[[0, 0], [1, 0], [0, 1]]]\nshort = [1]\n"
      "line = [[[0, 0], [1, 0]]]\n");

  EXPECT_EQ(table.list("list", {2, 3}), (std::vector<double>{1.0, 2.0, 3.0}));
  EXPECT_EQ(table.matrix("matrix", 2, 2), (std::vector<double>{1.0, 2.0, 3.0, 4.0}));
  EXPECT_TRUE(table.has_matrix("matrix"));
  EXPECT_FALSE(table.has_matrix("list"));
  ASSERT_TRUE(table.polygons("mask").has_value());
  EXPECT_FALSE(table.list("short", {2, 3}).has_value());
  EXPECT_FALSE(table.polygons("line").has_value());
  EXPECT_THAT(faults(), ElementsAre("4:9: short is a list of 1, expected a list of 2 or 3 numbers",
                                    HasSubstr("line has a list of 2 as a polygon")));
}

TEST_F(Toml, ListsItsKeysInTheOrderOfTheFile) {
  EXPECT_THAT(open("b = 1\na = 2\n[c]\n").keys(), ElementsAre("b", "a", "c"));
}

TEST(TomlFile, ThatIsNoTomlIsOneFaultWithItsPlace) {
  const support::TemporaryFolder folder;

  const auto file = TomlFile::open(folder.write("a.toml", "a = \n"));

  ASSERT_FALSE(file);
  ASSERT_EQ(file.error().list.size(), 1U);
  EXPECT_EQ(file.error().list[0].line, 1U);
}

}  // namespace toml_file_test
}  // namespace mocap::settings
