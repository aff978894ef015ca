#include "settings/example_config.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <regex>
#include <sstream>
#include <string>
#include <vector>

#include "cameras/camera_make.h"
#include "settings/daemon_settings.h"
#include "settings/faults.h"
#include "settings/key_list.h"
#include "settings/sections.h"
#include "support/places.h"
#include "support/temporary_folder.h"

namespace mocap::settings {
namespace example_config_test {

namespace fs = std::filesystem;

const fs::path kConfig = fs::path(support::source_folder()) / "config";

std::string text_of(const fs::path& path) {
  std::ifstream in(path);
  return {std::istreambuf_iterator<char>(in), {}};
}

// A table of the example: "[align]", "[[subject]]", or the [[camera]] of one make.
struct ExampleTable {
  std::string name;
  std::size_t begin = 0, end = 0;  // offsets in the example
  KeyList keys;
};

// A line of the example that sets a key; commented keys, too.
struct Line {
  std::size_t begin = 0, end = 0;  // offsets in the example, without the comment beside the value
  std::string comment;
};

std::size_t find_from(const std::string& text, const std::string& what, std::size_t from) {
  const std::size_t at = text.find(what, from);
  EXPECT_NE(at, std::string::npos) << what;
  return at;
}

std::vector<ExampleTable> tables_of(const std::string& example) {
  std::vector<ExampleTable> tables;
  DaemonSettings defaults;
  std::size_t at = 0;
  for (const Section& section : sections()) {
    at = find_from(example, fmt::format("\n[{}]", section.name), at) + 1;
    section.declare(tables.emplace_back(ExampleTable{fmt::format("[{}]", section.name), at, 0, {}}).keys, defaults);
  }
  at = find_from(example, "\n[[subject]]", at) + 1;
  SubjectSettings subject;
  declare_keys(tables.emplace_back(ExampleTable{"[[subject]]", at, 0, {}}).keys, subject);
  for (const cameras::CameraMake& make : cameras::camera_makes()) {
    at = find_from(example, "\n[[camera]]", at) + 1;
    cameras::CameraSettings camera{{}, make.defaults()};
    declare_keys(tables.emplace_back(ExampleTable{std::string(make.name.driver), at, 0, {}}).keys, camera);
  }
  for (std::size_t i = 0; i < tables.size(); ++i) {
    tables[i].end = i + 1 < tables.size() ? tables[i + 1].begin : example.size();
  }
  return tables;
}

Line line_of(const std::string& example, const ExampleTable& table, std::string_view key) {
  const std::regex pattern(fmt::format(R"(\n((?:# )?{} = [^#\n]*)(?:# ([^\n]*(?:\n {{32}}# [^\n]*)*))?)", key));
  const std::string text = example.substr(table.begin, table.end - table.begin);
  std::smatch found;
  if (!std::regex_search(text, found, pattern)) {
    ADD_FAILURE() << key << " is not in " << table.name << " of the example";
    return {};
  }
  const std::size_t begin = table.begin + static_cast<std::size_t>(found.position(1));
  return {begin, begin + static_cast<std::size_t>(found.length(1)),
          std::regex_replace(found[2].str(), std::regex("\n +# "), " ")};
}

// A folder with the files that the example names.
class ExampleFolder {
 public:
  ExampleFolder() {
    for (const char* name : {"rig.example.toml", "markersets", "skeletons"}) {
      fs::create_symlink(kConfig / name, folder_.path() / name);
    }
  }

  std::string faults_of(const std::string& text) {
    const auto settings = load_daemon_settings(folder_.write("example.toml", text));
    return settings ? "" : to_text(settings.error());
  }

 private:
  support::TemporaryFolder folder_;
};

// The example with another value of one key.
std::string with_value(const std::string& example, const Line& line, std::string_view key, std::string_view value) {
  return example.substr(0, line.begin) + fmt::format("{} = {}\n#", key, value) + example.substr(line.end);
}

// trigger = "action" needs a rate.
std::string with_rates(const std::string& example) {
  return std::regex_replace(example, std::regex("\n# rate_hz = "), "\nrate_hz = ");
}

std::string word_of(std::string_view choice) { return std::regex_replace(std::string(choice), std::regex("<n>"), "3"); }

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

TEST(ExampleConfig, IsTheShippedFile) {
  const std::vector<std::string> example = lines_of(example_config());
  const std::vector<std::string> shipped = lines_of(text_of(kConfig / "mocapd.toml"));

  // Only the first difference is reported.
  constexpr const char* kRemedy = "write the file again: mocapd --example-config > config/mocapd.toml";
  for (std::size_t i = 0; i < std::min(example.size(), shipped.size()); ++i) {
    ASSERT_EQ(shipped[i], example[i]) << kRemedy;
  }
  EXPECT_EQ(shipped.size(), example.size()) << kRemedy;
}

TEST(ExampleConfig, LoadsWithoutAFault) { EXPECT_EQ(ExampleFolder().faults_of(example_config()), ""); }

TEST(ExampleConfig, IsAtMost120ColumnsWide) {
  std::istringstream lines(example_config());
  for (std::string line; std::getline(lines, line);) EXPECT_LE(line.size(), 120U) << line;
}

TEST(ExampleConfig, ShowsEveryKeyOnceWithItsHelp) {
  const std::string example = example_config();

  for (const ExampleTable& table : tables_of(example)) {
    for (const ListedKey& listed : table.keys.entries()) {
      const Line line = line_of(example, table, listed.key.name);
      EXPECT_NE(line.comment.find(listed.key.doc.help), std::string::npos) << listed.key.name << " in " << table.name;
    }
  }
}

TEST(ExampleConfig, ShowsNoFormerName) {
  const std::string example = example_config();
  int former_names = 0;

  for (const ExampleTable& table : tables_of(example)) {
    for (const ListedKey& listed : table.keys.entries()) {
      const std::string_view formerly = listed.key.doc.formerly;
      if (formerly.empty()) continue;
      EXPECT_EQ(example.find(formerly), std::string::npos) << formerly;
      ++former_names;
    }
  }

  EXPECT_GT(former_names, 0);
}

TEST(ExampleConfig, ShowsTheDefaultOfEveryKeyThatHasOne) {
  const std::string example = example_config();

  for (const ExampleTable& table : tables_of(example)) {
    for (const ListedKey& listed : table.keys.entries()) {
      if (!listed.has_default) continue;
      const Line line = line_of(example, table, listed.key.name);
      EXPECT_EQ(
          example.substr(line.begin, line.end - line.begin).find(fmt::format("{} = {}", listed.key.name, listed.value)),
          0U)
          << listed.key.name << " in " << table.name;
    }
  }
}

TEST(ExampleConfig, LoadsWithTheExampleOfEveryKeyThatHasNoDefault) {
  ExampleFolder folder;
  const std::string example = example_config();

  for (const ExampleTable& table : tables_of(example)) {
    for (const ListedKey& listed : table.keys.entries()) {
      // One of several ways to name the device, or a file of the operator.
      const bool stands_for_another = listed.is_text && !listed.has_default;
      if (listed.has_default || stands_for_another) continue;
      const Line line = line_of(example, table, listed.key.name);
      EXPECT_EQ(folder.faults_of(with_value(example, line, listed.key.name, listed.key.doc.example)), "")
          << listed.key.name << " in " << table.name;
    }
  }
}

// The table of keys says which words a key takes.
TEST(EveryChoice, OfTheTablesLoads) {
  ExampleFolder folder;
  const std::string example = with_rates(example_config());
  int words = 0;

  for (const ExampleTable& table : tables_of(example)) {
    for (const ListedKey& listed : table.keys.entries()) {
      if (listed.key.name == "driver") continue;  // each driver has a table of its own in the example
      const Line line = line_of(example, table, listed.key.name);
      for (const std::string_view choice : listed.key.choices) {
        const std::string value = fmt::format("\"{}\"", word_of(choice));
        EXPECT_EQ(folder.faults_of(with_value(example, line, listed.key.name, value)), "")
            << listed.key.name << " = " << value << " in " << table.name;
        ++words;
      }
    }
  }

  EXPECT_GT(words, 30);
}

// The comments of the shipped file say it to the operator.
TEST(EveryChoice, ThatACommentOfTheShippedFileNamesLoads) {
  ExampleFolder folder;
  const std::string example = with_rates(text_of(kConfig / "mocapd.toml"));
  const std::string choice = "[A-Za-z0-9_<>]+(?:\\.[A-Za-z0-9]+)?";
  const std::regex list("one of (" + choice + "(?:, " + choice + ")*)");
  const std::regex word(choice);
  int words = 0;

  for (const ExampleTable& table : tables_of(example)) {
    for (const ListedKey& listed : table.keys.entries()) {
      if (listed.key.name == "driver") continue;
      const Line line = line_of(example, table, listed.key.name);
      std::smatch found;
      if (!std::regex_search(line.comment, found, list)) continue;
      const std::string choices = found[1];
      for (std::sregex_iterator each(choices.begin(), choices.end(), word), end; each != end; ++each) {
        const std::string value = fmt::format("\"{}\"", word_of(each->str()));
        EXPECT_EQ(folder.faults_of(with_value(example, line, listed.key.name, value)), "")
            << listed.key.name << " = " << value << " in " << table.name;
        ++words;
      }
    }
  }

  EXPECT_GT(words, 30);
}

TEST(EveryRange, HoldsItsEndsAndNothingBeyond) {
  ExampleFolder folder;
  const std::string example = example_config();

  for (const ExampleTable& table : tables_of(example)) {
    for (const ListedKey& listed : table.keys.entries()) {
      const auto [min, max] = listed.key.range;
      if (min == max || listed.is_list) continue;
      const Line line = line_of(example, table, listed.key.name);
      for (const double value : {min, max, min - 1.0, max + 1.0}) {
        const std::string faults =
            folder.faults_of(with_value(example, line, listed.key.name, fmt::format("{}", value)));
        // Rules between keys may refuse an end of a range, with other words.
        const std::string refusal =
            fmt::format("{} is {}, expected {}\n", listed.key.name, value, range_text(listed.key.range));
        const bool refused = faults.find(refusal) != std::string::npos;
        EXPECT_EQ(refused, value < min || value > max) << listed.key.name << " = " << value << " in " << table.name;
      }
    }
  }
}

}  // namespace example_config_test
}  // namespace mocap::settings
