#include "settings/toml/toml_file.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <toml++/toml.h>
#include <algorithm>
#include <cmath>
#include <set>
#include <unordered_set>

#include "settings/state_folder.h"
#include "settings/toml/suggestion.h"
#include "settings/toml/syntax_advice.h"
#include "settings/toml/text_file.h"

namespace mocap::settings {
namespace {

std::string in_quotes(std::string_view word) { return fmt::format("'{}'", word); }

// A value of the file as text in a fault.
std::string shown(const toml::node& node) {
  if (node.is_string()) return in_quotes(*node.value<std::string>());
  if (node.is_boolean()) return *node.value<bool>() ? "true" : "false";
  if (node.is_integer()) return fmt::format("{}", *node.value<std::int64_t>());
  if (node.is_floating_point()) return fmt::format("{}", *node.value<double>());
  if (node.is_array()) return fmt::format("a list of {}", node.as_array()->size());
  if (node.is_table()) return "a table";
  return "a date or time";
}

constexpr std::size_t kLeastCorners = 3;
constexpr KeyRange kCorner_px{-1e6, 1e6};  // a polygon may extend beyond its image

std::optional<PixelPoint> corner_of(const toml::node& node) {
  const toml::array* pair = node.as_array();
  if (pair == nullptr || pair->size() != 2) return std::nullopt;
  PixelPoint corner;
  for (const std::size_t axis : {0U, 1U}) {
    const toml::node& number = (*pair)[axis];
    const auto value = number.is_number() ? number.value<double>() : std::nullopt;
    if (!value || !is_within(*value, kCorner_px)) return std::nullopt;
    corner.v[static_cast<Eigen::Index>(axis)] = *value;
  }
  return corner;
}

}  // namespace

struct TomlFile::Document {
  toml::table root;
  std::filesystem::path path;
  Faults faults;

  void fault(const toml::source_position& at, std::string message) {
    faults.list.push_back({path, at.line, at.column, std::move(message)});
  }
};

struct TomlTable::State {
  // A required key that the table does not have, and the message of its fault.
  struct Missing {
    std::string key, expected, message;
  };
  TomlFile::Document* document;
  const toml::table* table;
  std::string who;
  std::vector<std::string> known = {};   // keys that were asked for
  std::vector<std::string> faulty = {};  // keys that have a fault
  std::vector<Missing> missing_keys = {};
  std::vector<std::string> unknown = {};  // keys of the table that done() did not know

  static void remember(std::vector<std::string>& keys, std::string_view key) {
    if (std::find(keys.begin(), keys.end(), key) == keys.end()) keys.emplace_back(key);
  }
  void learn(std::string_view key) { remember(known, key); }
  bool is_faulty(std::string_view key) const { return std::find(faulty.begin(), faulty.end(), key) != faulty.end(); }

  const toml::node* find(std::string_view key) {
    learn(key);
    return table->get(key);
  }
  const toml::node* find(const Key& key) {
    const toml::node* node = find(key.name);
    if (node == nullptr && !key.doc.required.empty()) missing(key.name, key.doc.required);
    return node;
  }

  void fault(const toml::source_position& at, std::string_view message) const {
    document->fault(at, who.empty() ? std::string(message) : fmt::format("{}: {}", who, message));
  }
  void fault(std::string_view key, const toml::source_position& at, std::string_view message) {
    remember(faulty, key);
    fault(at, message);
  }
  void missing(std::string_view key, std::string_view expected) {
    remember(faulty, key);
    // done() has named the misspelt key already.
    if (std::ranges::any_of(unknown, [&](const std::string& word) { return is_near(word, key); })) return;
    const std::string message = fmt::format("{} is missing, expected {}", key, expected);
    missing_keys.push_back({std::string(key), std::string(expected), message});
    fault(table->source().begin, message);
  }
  // Replaces the fault of a missing key by the fault of the unknown key `name` that is probably meant. Returns whether
  // there is one.
  bool correct(const std::string& name, const toml::source_position& at) {
    const auto meant = std::ranges::find_if(missing_keys, [&](const Missing& each) { return is_near(name, each.key); });
    if (meant == missing_keys.end()) return false;
    std::erase_if(document->faults.list, [&](const Fault& each) {
      return each.line == table->source().begin.line && each.message.ends_with(meant->message);
    });
    fault(at, fmt::format("unknown key '{}', did you mean '{}'? Expected {}", name, meant->key, meant->expected));
    missing_keys.erase(meant);
    return true;
  }
  static bool is_near(const std::string& word, std::string_view key) {
    return nearest_word(word, {std::string(key)}).has_value();
  }
  void unexpected(std::string_view key, const toml::node& node, std::string_view expected) {
    fault(key, node.source().begin, fmt::format("{} is {}, expected {}", key, shown(node), expected));
  }
  // Adds a fault at an element of a list.
  void unexpected_in(std::string_view key, const toml::node& element, std::string_view expected) {
    fault(key, element.source().begin, fmt::format("{} has {}, expected {}", key, shown(element), expected));
  }
  // Appends the numbers of a list. Returns false, with a fault, at an element that is no finite number.
  bool append_numbers(std::string_view key, const toml::array& list, std::vector<double>& into) {
    for (const toml::node& element : list) {
      const auto value = element.is_number() ? element.value<double>() : std::nullopt;
      if (!value || !std::isfinite(*value)) {
        unexpected_in(key, element, "finite numbers");
        return false;
      }
      into.push_back(*value);
    }
    return true;
  }
};

TomlTable::TomlTable(std::shared_ptr<State> state) : state_(std::move(state)) {}

void TomlTable::visit(const Key& key, bool& field) {
  const toml::node* node = state_->find(key);
  if (node == nullptr) return;
  if (!node->is_boolean()) return state_->unexpected(key.name, *node, "true or false");
  field = *node->value<bool>();
}

void TomlTable::visit(const Key& key, std::optional<double>& value) {
  const toml::node* node = state_->find(key);
  if (node == nullptr) return;
  const std::string range = range_text(key.range);
  if (!node->is_number()) return state_->unexpected(key.name, *node, "a number, " + range);
  const auto found = node->value<double>();
  if (!is_within(*found, key.range)) return state_->unexpected(key.name, *node, range);
  value = found;
}

void TomlTable::visit(const Key& key, std::optional<std::int64_t>& value) {
  const toml::node* node = state_->find(key);
  if (node == nullptr) return;
  const std::string range = range_text(key.range);
  if (!node->is_integer()) return state_->unexpected(key.name, *node, "a whole number, " + range);
  const std::int64_t found = *node->value<std::int64_t>();
  if (!is_within(static_cast<double>(found), key.range)) return state_->unexpected(key.name, *node, range);
  value = found;
}

void TomlTable::visit(const Key& key, std::string& field) {
  const toml::node* node = state_->find(key);
  if (node == nullptr) return;
  if (node->is_string() && is_choice(key, *node->value<std::string>())) {
    field = *node->value<std::string>();
    return;
  }
  if (key.choices.empty()) return state_->unexpected(key.name, *node, "a text in quotes");
  std::string expected = choices_text(key);
  if (node->is_string()) {
    const auto near = nearest_word(*node->value<std::string>(), {key.choices.begin(), key.choices.end()});
    if (near) expected += fmt::format("; did you mean '{}'?", *near);
  }
  state_->unexpected(key.name, *node, expected);
}

void TomlTable::visit(const Key& key, std::filesystem::path& field) {
  const toml::node* node = state_->find(key);
  if (node == nullptr) return;
  if (!node->is_string()) return state_->unexpected(key.name, *node, "a path in quotes");
  const std::filesystem::path path = *node->value<std::string>();
  // An absolute path stays as it is, and so does a credential that no service manager provides.
  const std::filesystem::path resolved = resolve_credential(path);
  field = path.empty() || is_unresolved_credential(resolved)
              ? resolved
              : (state_->document->path.parent_path() / resolved).lexically_normal();
  std::error_code ignored;
  if (key.doc.must_exist && !field.empty() && !std::filesystem::exists(field, ignored)) {
    fault(key.name, fmt::format("{} is '{}', and there is none", key.name, field.string()));
  }
}

void TomlTable::visit(const Key& key, std::vector<int>& field) {
  const toml::node* node = state_->find(key);
  if (node == nullptr) return;
  const std::string expected = "a list of whole numbers " + range_text(key.range);
  if (!node->is_array()) return state_->unexpected(key.name, *node, expected);
  std::vector<int> found;
  for (const toml::node& element : *node->as_array()) {
    const auto value = element.is_integer() ? element.value<std::int64_t>() : std::nullopt;
    if (!value || !is_within(static_cast<double>(*value), key.range)) {
      return state_->unexpected_in(key.name, element, expected);
    }
    found.push_back(static_cast<int>(*value));
  }
  field = std::move(found);
}

void TomlTable::visit(const Key& key, std::vector<std::string>& field) {
  const toml::node* node = state_->find(key);
  if (node == nullptr) return;
  const std::string expected = "a list of texts";
  if (!node->is_array()) return state_->unexpected(key.name, *node, expected);
  std::vector<std::string> found;
  for (const toml::node& element : *node->as_array()) {
    if (!element.is_string()) return state_->unexpected_in(key.name, element, expected);
    found.push_back(*element.value<std::string>());
  }
  field = std::move(found);
}

void TomlTable::visit(const Key& key, std::span<double> fields) {
  state_->find(key);
  const auto found = list(key.name, {fields.size()});
  if (!found) return;
  for (const double value : *found) {
    if (!is_within(value, key.range)) {
      return fault(key.name, fmt::format("{} has {}, expected {}", key.name, value, range_text(key.range)));
    }
  }
  std::ranges::copy(*found, fields.begin());
}

void TomlTable::visit(const Key& key, KeyPairs& field) {
  const toml::node* node = state_->find(key);
  if (node == nullptr) return;
  if (!node->is_table()) {
    return state_->unexpected(key.name, *node, "a table, as { Name = 1, Other = \"On\" }");
  }
  struct Entry {
    toml::source_position at;
    std::string name, text;
  };
  std::vector<Entry> entries;
  for (const auto& [name, value] : *node->as_table()) {
    if (!value.is_string() && !value.is_number() && !value.is_boolean()) {
      return state_->fault(
          key.name, value.source().begin,
          fmt::format("{}: {} is {}, expected a word, a number, true or false", key.name, name.str(), shown(value)));
    }
    entries.push_back(
        {name.source().begin, std::string(name.str()), value.is_string() ? *value.value<std::string>() : shown(value)});
  }
  // One feature may select the meaning of the next: their order is that of the file.
  std::sort(entries.begin(), entries.end(), [](const Entry& a, const Entry& b) { return a.at < b.at; });
  field.clear();
  for (Entry& each : entries) field.emplace_back(std::move(each.name), std::move(each.text));
}

std::optional<std::vector<double>> TomlTable::list(std::string_view key, std::initializer_list<std::size_t> lengths) {
  const toml::node* node = state_->find(key);
  if (node == nullptr) return std::nullopt;
  std::vector<std::string> counts;
  for (const std::size_t length : lengths) counts.push_back(std::to_string(length));
  const std::string expected = fmt::format("a list of {} numbers", fmt::join(counts, " or "));
  const toml::array* array = node->as_array();
  if (array == nullptr || std::find(lengths.begin(), lengths.end(), array->size()) == lengths.end()) {
    state_->unexpected(key, *node, expected);
    return std::nullopt;
  }
  std::vector<double> found;
  if (!state_->append_numbers(key, *array, found)) return std::nullopt;
  return found;
}

std::optional<std::vector<double>> TomlTable::matrix(std::string_view key, std::size_t rows, std::size_t columns) {
  const toml::node* node = state_->find(key);
  if (node == nullptr) return std::nullopt;
  const std::string expected = fmt::format("{} lists of {} numbers", rows, columns);
  const toml::array* array = node->as_array();
  if (array == nullptr || array->size() != rows) {
    state_->unexpected(key, *node, expected);
    return std::nullopt;
  }
  std::vector<double> found;
  for (const toml::node& row : *array) {
    if (!row.is_array() || row.as_array()->size() != columns) {
      state_->fault(row.source().begin, fmt::format("{} has {} as a row, expected {}", key, shown(row), expected));
      return std::nullopt;
    }
    if (!state_->append_numbers(key, *row.as_array(), found)) return std::nullopt;
  }
  return found;
}

std::optional<std::vector<MaskPolygon>> TomlTable::polygons(std::string_view key) {
  const toml::node* node = state_->find(key);
  if (node == nullptr) return std::nullopt;
  if (!node->is_array()) {
    state_->unexpected(key, *node, "a list of polygons: [[[x, y], [x, y], [x, y]], ...]");
    return std::nullopt;
  }
  std::vector<MaskPolygon> found;
  for (const toml::node& polygon : *node->as_array()) {
    const toml::array* corners = polygon.as_array();
    if (corners == nullptr || corners->size() < kLeastCorners) {
      state_->fault(polygon.source().begin,
                    fmt::format("{} has {} as a polygon, expected a list of at least 3 corners", key, shown(polygon)));
      return std::nullopt;
    }
    MaskPolygon& into = found.emplace_back();
    for (const toml::node& corner : *corners) {
      const std::optional<PixelPoint> at = corner_of(corner);
      if (!at) {
        state_->fault(corner.source().begin, fmt::format("{} has {} as a corner, expected [x, y], px, each {}", key,
                                                         shown(corner), range_text(kCorner_px)));
        return std::nullopt;
      }
      into.push_back(*at);
    }
  }
  return found;
}

bool TomlTable::has(std::string_view key) const { return state_->table->contains(key); }

bool TomlTable::has_matrix(std::string_view key) const {
  const toml::array* array = state_->table->get_as<toml::array>(key);
  return array != nullptr && !array->empty() && (*array)[0].is_array();
}

std::optional<TomlTable> TomlTable::table(std::string_view key, std::string who) {
  const toml::node* node = state_->find(key);
  if (node == nullptr) return std::nullopt;
  if (!node->is_table()) {
    const toml::array* array = node->as_array();
    if (array != nullptr && !array->empty() && array->front().is_table()) {
      state_->fault(key, node->source().begin,
                    fmt::format("[[{0}]] has two brackets, expected [{0}]: this section exists once", key));
    } else {
      state_->unexpected(key, *node, fmt::format("a table: [{}]", key));
    }
    return std::nullopt;
  }
  return TomlTable(std::make_shared<State>(State{state_->document, node->as_table(), std::move(who)}));
}

std::vector<TomlTable> TomlTable::tables(std::string_view key, std::string_view who) {
  std::vector<TomlTable> found;
  const toml::node* node = state_->find(key);
  if (node == nullptr) return found;
  const toml::array* array = node->as_array();
  const auto is_table = [](const toml::node& element) { return element.is_table(); };
  if (array == nullptr || !std::all_of(array->begin(), array->end(), is_table)) {
    if (node->is_table()) {
      state_->fault(key, node->source().begin,
                    fmt::format("[{0}] has one bracket, expected [[{0}]]: one such table for each {0}", key));
    } else {
      state_->unexpected(key, *node, fmt::format("tables: [[{}]]", key));
    }
    return found;
  }
  for (const toml::node& element : *array) {
    std::string name = fmt::format("{} {}", who, found.size() + 1);
    found.push_back(TomlTable(std::make_shared<State>(State{state_->document, element.as_table(), name})));
  }
  return found;
}

std::vector<std::string> TomlTable::keys() const {
  std::vector<std::pair<toml::source_position, std::string>> placed;
  for (const auto& [key, node] : *state_->table) placed.emplace_back(key.source().begin, std::string(key.str()));
  std::sort(placed.begin(), placed.end());
  std::vector<std::string> found;
  for (auto& [place, key] : placed) found.push_back(std::move(key));
  return found;
}

void TomlTable::move_to(const std::filesystem::path& folder, std::string_view key, std::filesystem::path& field) const {
  const toml::node* node = state_->table->get(key);
  const std::filesystem::path path = node == nullptr ? std::string{} : node->value<std::string>().value_or("");
  if (!path.empty() && path.is_relative()) field = (folder / path).lexically_normal();
}

std::optional<std::uint32_t> TomlTable::line_of(std::string_view key) const {
  const toml::node* node = state_->table->get(key);
  return node == nullptr ? std::nullopt : std::optional<std::uint32_t>(node->source().begin.line);
}

FoundFile TomlTable::shipped_file(std::string_view key) const {
  const std::string named = (*state_->table)[key].value_or(std::string{});
  return named.empty() ? FoundFile{} : find_shipped(named, state_->document->path.parent_path());
}

void TomlTable::ignore(std::string_view key) { state_->learn(key); }

bool TomlTable::require(std::string_view key, std::string_view expected) {
  state_->learn(key);
  if (has(key)) return true;
  state_->missing(key, expected);
  return false;
}

void TomlTable::fault(std::string_view key, std::string_view message) {
  const toml::node* node = state_->table->get(key);
  state_->fault(key, node == nullptr ? state_->table->source().begin : node->source().begin, message);
}

void TomlTable::fault(std::string_view message) { state_->fault(state_->table->source().begin, message); }

void TomlTable::add(const std::vector<KeyFault>& faults) {
  for (const KeyFault& each : faults) {
    if (each.key.empty()) {
      fault(each.message);
    } else if (!state_->is_faulty(each.key)) {
      fault(each.key, each.message);
    }
  }
}

void TomlTable::done() {
  for (const auto& [key, node] : *state_->table) {
    const std::string name(key.str());
    if (std::find(state_->known.begin(), state_->known.end(), name) != state_->known.end()) continue;
    state_->unknown.push_back(name);
    if (state_->correct(name, key.source().begin)) continue;
    const auto near = nearest_word(name, state_->known);
    const std::string advice = near ? fmt::format(", did you mean '{}'?", *near)
                                    : fmt::format("; known are {}", fmt::join(state_->known, ", "));
    state_->fault(key.source().begin, fmt::format("unknown key '{}'{}", name, advice));
  }
}

void TomlTable::correct_missing() {
  for (const auto& [key, node] : *state_->table) {
    const std::string name(key.str());
    if (std::ranges::find(state_->known, name) == state_->known.end()) state_->correct(name, key.source().begin);
  }
}

bool TomlTable::has_table_with(std::string_view key) const {
  return std::ranges::any_of(*state_->table, [&](const auto& entry) {
    const toml::table* table = entry.second.as_table();
    return table != nullptr && table->contains(key);
  });
}

void TomlTable::call(std::string who) { state_->who = std::move(who); }

void TomlTable::call_by(std::string_view key, std::string_view what) {
  const toml::node* node = state_->find(key);
  const std::string name = node != nullptr ? node->value<std::string>().value_or("") : "";
  if (!name.empty()) call(fmt::format("{} '{}'", what, name));
}

const std::string& TomlTable::who() const { return state_->who; }

TomlFile::TomlFile(std::unique_ptr<Document> document) : document_(std::move(document)) {}
TomlFile::TomlFile(TomlFile&&) noexcept = default;
TomlFile& TomlFile::operator=(TomlFile&&) noexcept = default;
TomlFile::~TomlFile() = default;

Result<TomlFile, Faults> TomlFile::open(const std::filesystem::path& path) {
  const Result<std::string, Fault> text = read_text(path);
  if (!text) return Faults{path, {text.error()}};
  try {
    auto document = std::make_unique<Document>();
    document->root = toml::parse(*text, path.string());
    document->path = path;
    document->faults.file = path;
    return TomlFile(std::move(document));
  } catch (const toml::parse_error& error) {
    const auto at = error.source().begin;
    return Faults{path, {{path, at.line, at.column, explain_syntax(*text, at.line, error.description())}}};
  }
}

TomlTable TomlFile::root() {
  return TomlTable(std::make_shared<TomlTable::State>(TomlTable::State{document_.get(), &document_->root, {}}));
}

const Faults& TomlFile::faults() const { return document_->faults; }

void TomlFile::add(const Faults& faults) {
  document_->faults.list.insert(document_->faults.list.end(), faults.list.begin(), faults.list.end());
}

}  // namespace mocap::settings
