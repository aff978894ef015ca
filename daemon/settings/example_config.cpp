#include "settings/example_config.h"

#include <fmt/format.h>

#include <string_view>
#include <vector>

#include "base/expects.h"
#include "cameras/camera_make.h"
#include "cameras/camera_settings.h"
#include "model/bounds.h"
#include "settings/daemon_settings.h"
#include "settings/key_list.h"
#include "settings/sections.h"

namespace mocap::settings {
namespace {

constexpr std::size_t kColumns = 120;
constexpr std::size_t kCommentColumn = 32;

constexpr const char* kIntroduction =
    "mocapd: every setting with its default, its range or choices, and its meaning. A key that is left out has the "
    "value "
    "shown here. A commented key has no default; its value is an example. The unit of a number is the end of its name. "
    "Paths are relative to this file. `mocapd --check-config FILE` lists all faults of a file. `mocapd "
    "--example-config` "
    "writes this file.";

// The words of a text in lines of at most `columns` characters.
std::vector<std::string> wrapped(std::string_view text, std::size_t columns) {
  std::vector<std::string> lines;
  std::string line;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find(' '), text.size());
    const std::string_view word = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    if (!line.empty() && line.size() + 1 + word.size() > columns) lines.push_back(std::exchange(line, {}));
    line += fmt::format("{}{}", line.empty() ? "" : " ", word);
  }
  if (!line.empty()) lines.push_back(line);
  return lines;
}

std::string paragraph(std::string_view text) {
  std::string lines;
  for (const std::string& line : wrapped(text, kColumns - 2)) lines += fmt::format("# {}\n", line);
  return lines;
}

// "# --- output ---------", as wide as the file.
std::string heading_line(std::string_view heading) {
  const std::string begin = fmt::format("# --- {} ", heading);
  return fmt::format("{:-<{}}\n", begin, kColumns);
}

// A line and the comment beside it, which goes on in the same column.
std::string commented(const std::string& line, std::string_view comment) {
  if (comment.empty()) return fmt::format("{}\n", line);
  const std::size_t column = std::max(kCommentColumn, line.size() + 2);
  std::string text = fmt::format("{:<{}}", line, column);
  // The first line may be narrower than those that follow.
  const std::vector<std::string> first = wrapped(comment, kColumns - column - 2);
  text += fmt::format("# {}\n", first.front());
  if (first.size() == 1) return text;
  const std::string_view rest = comment.substr(first.front().size() + 1);
  for (const std::string& each : wrapped(rest, kColumns - kCommentColumn - 2)) {
    text += fmt::format("{:{}}# {}\n", "", kCommentColumn, each);
  }
  return text;
}

// The values that a key may have; empty if any.
std::string values_text(const ListedKey& listed) {
  const Key& key = listed.key;
  if (!key.choices.empty()) return choices_text(key);
  if (key.range.min == key.range.max) return {};
  return fmt::format("{}{}", listed.is_list ? "each " : "", range_text(key.range));
}

std::string comment_of(const ListedKey& listed) {
  const std::string values = values_text(listed);
  const std::string_view help = listed.key.doc.help;
  return fmt::format("{}{}{}", values, help.empty() || values.empty() ? "" : "; ", help);
}

// Where a value of the example is not the default, it is the example of the key.
std::string line_of(const ListedKey& listed) {
  const KeyDoc& doc = listed.key.doc;
  if (listed.has_default || doc.example.empty()) {
    MOCAP_EXPECTS(!listed.value.empty());  // a number without a default needs an example
    return fmt::format("{} = {}", listed.key.name, listed.value);
  }
  const bool is_active = doc.example_is_active || !doc.required.empty();
  const char* quote = listed.is_text ? "\"" : "";
  return fmt::format("{}{} = {}{}{}", is_active ? "" : "# ", listed.key.name, quote, doc.example, quote);
}

std::string lines_of(const KeyList& list) {
  std::string text;
  for (const ListedKey& listed : list.entries()) {
    if (!listed.note.empty()) text += paragraph(listed.note);
    text += commented(line_of(listed), comment_of(listed));
  }
  return text;
}

std::string section_text(const Section& section, DaemonSettings& defaults) {
  KeyList list;
  section.declare(list, defaults);
  std::string text;
  if (section.heading != nullptr) text = fmt::format("{}\n", heading_line(section.heading));
  return text + commented(fmt::format("[{}]", section.name), section.help) + lines_of(list);
}

std::string subject_text() {
  SubjectSettings subject;
  KeyList list;
  declare_keys(list, subject);
  return fmt::format("{}\n[[subject]]\n{}", heading_line(fmt::format("subjects: up to {}", kMaxSubjects)),
                     lines_of(list));
}

std::string camera_text(const cameras::CameraMake& make) {
  cameras::CameraSettings camera{.name = {}, .driver = make.defaults()};
  KeyList list;
  declare_keys(list, camera);
  return commented("[[camera]]", make.name.help) + lines_of(list);
}

}  // namespace

std::string example_config() {
  DaemonSettings defaults;
  std::string text = paragraph(kIntroduction);
  for (const Section& section : sections()) text += fmt::format("\n{}", section_text(section, defaults));
  text += fmt::format("\n{}", subject_text());
  text += fmt::format("\n{}", heading_line(fmt::format("cameras: up to {}, in the order of their ids", kMaxCameras)));
  for (const cameras::CameraMake& make : cameras::camera_makes()) text += fmt::format("\n{}", camera_text(make));
  return text;
}

}  // namespace mocap::settings
