#include "settings/toml/toml_file.h"

#include <fmt/format.h>

#include <toml++/toml.h>
#include <algorithm>
#include <system_error>
#include <utility>

#include "settings/state_folder.h"
#include "settings/toml/known_keys.h"
#include "settings/toml/number_lists.h"
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

Place place_of(const toml::node& node) { return {node.source().begin.line, node.source().begin.column}; }

NumberNode number_node(const toml::node& node) {
  NumberNode found{
      place_of(node), shown(node), node.is_number() ? node.value<double>() : std::nullopt, node.is_array(), {}};
  if (const toml::array* array = node.as_array()) {
    for (const toml::node& element : *array) found.elements.push_back(number_node(element));
  }
  return found;
}

}  // namespace

struct TomlFile::Document {
  toml::table root;
  Faults faults;

  std::filesystem::path folder() const { return faults.file.parent_path(); }
};

struct TomlTable::State {
  State(TomlFile::Document& of, const toml::table& read, std::string who)
      : document(&of), table(&read), keys(of.faults, place_of(read), std::move(who)) {}

  TomlFile::Document* document;
  const toml::table* table;
  KnownKeys keys;

  const toml::node* find(std::string_view key) {
    keys.learn(key);
    return table->get(key);
  }
  // The value of the key or, if absent, of its former name.
  const toml::node* find(const Key& key) {
    const toml::node* node = find(key.name);
    const std::string_view formerly = key.doc.formerly;
    const toml::node* former = formerly.empty() ? nullptr : table->get(formerly);
    if (former != nullptr) keys.learn(formerly);
    if (node != nullptr && former != nullptr) {
      keys.fault(key.name, place_of(*former),
                 fmt::format("{} is the former name of {}, expected one of them", formerly, key.name));
    }
    if (node == nullptr) node = former;
    if (node == nullptr && !key.doc.required.empty()) keys.missing(key.name, key.doc.required);
    return node;
  }

  void unexpected(std::string_view key, const toml::node& node, std::string_view expected) {
    keys.fault(key, place_of(node), fmt::format("{} is {}, expected {}", key, shown(node), expected));
  }
  // Adds a fault at an element of a list.
  void unexpected_in(std::string_view key, const toml::node& element, std::string_view expected) {
    keys.fault(key, place_of(element), fmt::format("{} has {}, expected {}", key, shown(element), expected));
  }
  // The value of the key if there was no fault.
  template <class T>
  std::optional<T> accept(std::string_view key, Result<T, NumberFault> found) {
    if (found) return *std::move(found);
    keys.fault(key, found.error().at, found.error().message);
    return std::nullopt;
  }
  // All keys with their places, in the order of the file.
  std::vector<std::pair<std::string, Place>> placed_keys() const {
    std::vector<std::pair<std::string, Place>> found;
    for (const auto& [key, node] : *table) {
      found.emplace_back(key.str(), Place{key.source().begin.line, key.source().begin.column});
    }
    std::ranges::sort(found, {}, [](const auto& each) { return std::pair(each.second.line, each.second.column); });
    return found;
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
              : (state_->document->folder() / resolved).lexically_normal();
  std::error_code ignored;
  if (key.doc.must_exist && !field.empty() && !std::filesystem::exists(field, ignored)) {
    state_->keys.fault(key.name, place_of(*node),
                       fmt::format("{} is '{}', and there is none", key.name, field.string()));
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
  const toml::node* node = state_->find(key);
  if (node == nullptr) return;
  const auto found = state_->accept(key.name, list_of(key.name, number_node(*node), {fields.size()}));
  if (!found) return;
  const auto wrong = std::ranges::find_if(*found, [&](double value) { return !is_within(value, key.range); });
  if (wrong != found->end()) {
    return state_->keys.fault(key.name, place_of(*node),
                              fmt::format("{} has {}, expected {}", key.name, *wrong, range_text(key.range)));
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
      return state_->keys.fault(
          key.name, place_of(value),
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
  return state_->accept(key, list_of(key, number_node(*node), lengths));
}

std::optional<std::vector<double>> TomlTable::matrix(std::string_view key, std::size_t rows, std::size_t columns) {
  const toml::node* node = state_->find(key);
  if (node == nullptr) return std::nullopt;
  return state_->accept(key, matrix_of(key, number_node(*node), rows, columns));
}

std::optional<std::vector<MaskPolygon>> TomlTable::polygons(std::string_view key) {
  const toml::node* node = state_->find(key);
  if (node == nullptr) return std::nullopt;
  return state_->accept(key, polygons_of(key, number_node(*node)));
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
      state_->keys.fault(key, place_of(*node),
                         fmt::format("[[{0}]] has two brackets, expected [{0}]: this section exists once", key));
    } else {
      state_->unexpected(key, *node, fmt::format("a table: [{}]", key));
    }
    return std::nullopt;
  }
  return TomlTable(std::make_shared<State>(*state_->document, *node->as_table(), std::move(who)));
}

std::vector<TomlTable> TomlTable::tables(std::string_view key, std::string_view who) {
  std::vector<TomlTable> found;
  const toml::node* node = state_->find(key);
  if (node == nullptr) return found;
  const toml::array* array = node->as_array();
  const auto is_table = [](const toml::node& element) { return element.is_table(); };
  if (array == nullptr || !std::all_of(array->begin(), array->end(), is_table)) {
    if (node->is_table()) {
      state_->keys.fault(key, place_of(*node),
                         fmt::format("[{0}] has one bracket, expected [[{0}]]: one such table for each {0}", key));
    } else {
      state_->unexpected(key, *node, fmt::format("tables: [[{}]]", key));
    }
    return found;
  }
  for (const toml::node& element : *array) {
    std::string name = fmt::format("{} {}", who, found.size() + 1);
    found.push_back(TomlTable(std::make_shared<State>(*state_->document, *element.as_table(), name)));
  }
  return found;
}

std::vector<std::string> TomlTable::keys() const {
  std::vector<std::string> found;
  for (auto& [key, place] : state_->placed_keys()) found.push_back(std::move(key));
  return found;
}

void TomlTable::move_to(const std::filesystem::path& folder, std::string_view key, std::filesystem::path& field) const {
  const toml::node* node = state_->table->get(key);
  const std::filesystem::path path = node == nullptr ? std::string{} : node->value<std::string>().value_or("");
  if (!path.empty() && path.is_relative()) field = (folder / path).lexically_normal();
}

std::optional<std::uint32_t> TomlTable::line_of(const Key& key) const {
  const toml::node* node = state_->table->get(has(key.name) ? key.name : key.doc.formerly);
  return node == nullptr ? std::nullopt : std::optional<std::uint32_t>(node->source().begin.line);
}

FoundFile TomlTable::shipped_file(std::string_view key) const {
  const std::string named = (*state_->table)[key].value_or(std::string{});
  return named.empty() ? FoundFile{} : find_shipped(named, state_->document->folder());
}

void TomlTable::ignore(std::string_view key) { state_->keys.learn(key); }

bool TomlTable::require(std::string_view key, std::string_view expected) {
  state_->keys.learn(key);
  if (has(key)) return true;
  state_->keys.missing(key, expected);
  return false;
}

void TomlTable::fault(std::string_view key, std::string_view message) {
  const toml::node* node = state_->table->get(key);
  state_->keys.fault(key, place_of(node == nullptr ? *state_->table : *node), message);
}

void TomlTable::fault(std::string_view message) { state_->keys.fault(place_of(*state_->table), message); }

void TomlTable::add(const std::vector<KeyFault>& faults) {
  for (const KeyFault& each : faults) {
    if (each.key.empty()) {
      fault(each.message);
    } else if (!state_->keys.is_faulty(each.key)) {
      fault(each.key, each.message);
    }
  }
}

void TomlTable::done() {
  for (const auto& [key, place] : state_->placed_keys()) state_->keys.judge(key, place);
}

void TomlTable::correct_missing() {
  for (const auto& [key, place] : state_->placed_keys()) state_->keys.correct(key, place);
}

bool TomlTable::has_table_with(std::string_view key) const {
  return std::ranges::any_of(*state_->table, [&](const auto& entry) {
    const toml::table* table = entry.second.as_table();
    return table != nullptr && table->contains(key);
  });
}

void TomlTable::call(std::string who) { state_->keys.call(std::move(who)); }

void TomlTable::call_by(std::string_view key, std::string_view what) {
  const toml::node* node = state_->find(key);
  const std::string name = node != nullptr ? node->value<std::string>().value_or("") : "";
  if (!name.empty()) call(fmt::format("{} '{}'", what, name));
}

const std::string& TomlTable::who() const { return state_->keys.who(); }

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
    document->faults.file = path;
    return TomlFile(std::move(document));
  } catch (const toml::parse_error& error) {
    const auto at = error.source().begin;
    return Faults{path, {{path, at.line, at.column, explain_syntax(*text, at.line, error.description())}}};
  }
}

TomlTable TomlFile::root() {
  return TomlTable(std::make_shared<TomlTable::State>(*document_, document_->root, std::string()));
}

const Faults& TomlFile::faults() const { return document_->faults; }

void TomlFile::add(const Faults& faults) {
  document_->faults.list.insert(document_->faults.list.end(), faults.list.begin(), faults.list.end());
}

}  // namespace mocap::settings
