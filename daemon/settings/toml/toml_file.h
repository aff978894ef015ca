#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/key_visitor.h"
#include "base/result.h"
#include "model/image_mask.h"
#include "settings/faults.h"
#include "settings/shipped_files.h"

namespace mocap::settings {

class TomlFile;

/// A table of a TOML file while it is read. A visitor that fills a settings struct from the file: a wrong value is a
/// fault, and the field keeps its default. Every key that is asked for is known; `done` makes a fault of each other
/// key. Copies share their state. The file outlives it.
class TomlTable final : public KeyVisitor {
 public:
  /// A list of finite numbers whose length is one of `lengths`; anything else is a fault. Nothing if the key is absent
  /// or has a fault.
  std::optional<std::vector<double>> list(std::string_view key, std::initializer_list<std::size_t> lengths);

  /// `rows` lists of `columns` finite numbers each, row by row; otherwise as `list`.
  std::optional<std::vector<double>> matrix(std::string_view key, std::size_t rows, std::size_t columns);

  /// A list of polygons, each a list of at least three corners [x, y], px; otherwise as `list`.
  std::optional<std::vector<MaskPolygon>> polygons(std::string_view key);

  bool has(std::string_view key) const;
  /// Whether the value of the key is a list of lists.
  bool has_matrix(std::string_view key) const;

  /// The table `[key]`; nothing if the key is absent. Another value is a fault.
  std::optional<TomlTable> table(std::string_view key, std::string who);
  /// The tables of `[[key]]` in the order of the file.
  std::vector<TomlTable> tables(std::string_view key, std::string_view who);
  /// All keys, in the order of the file.
  std::vector<std::string> keys() const;

  /// Sets `field` to the path of the key in `folder` instead of the file's own folder, if it is relative.
  void move_to(const std::filesystem::path& folder, std::string_view key, std::filesystem::path& field) const;
  /// The line of the key or, if absent, of its former name, from 1; nothing if both are absent.
  std::optional<std::uint32_t> line_of(const Key& key) const;
  /// Searches the file that the key names: relative to this file, then in the folder of the shipped files. Empty if the
  /// key is absent or no text.
  FoundFile shipped_file(std::string_view key) const;

  /// Makes the key known without reading it.
  void ignore(std::string_view key);
  /// Whether the key is there; an absent key is a fault.
  bool require(std::string_view key, std::string_view expected);

  /// Adds the fault "who: message" at the value of the key, or at the table if it does not have the key.
  void fault(std::string_view key, std::string_view message);
  /// Adds the fault "who: message" at the table.
  void fault(std::string_view message);
  /// Adds faults of rules between keys. A rule about a key that has a fault already is left out: the field does not
  /// have the value of the file.
  void add(const std::vector<KeyFault>& faults);

  /// Adds a fault for each key that was not asked for. If such a key is probably a misspelt required key, this fault
  /// replaces that of the missing key.
  void done();
  /// Only this replacement, for a table whose other keys cannot be judged.
  void correct_missing();
  /// Whether a value of this table is a table with the key.
  bool has_table_with(std::string_view key) const;

  /// Sets the name of this table in faults, as "camera 'north-east'"; empty for keys of the file itself.
  void call(std::string who);
  /// Sets this name to "`what` 'VALUE'" if the key is a text that is not empty.
  void call_by(std::string_view key, std::string_view what);
  const std::string& who() const;

 protected:
  void visit(const Key& key, bool& field) override;
  void visit(const Key& key, std::optional<double>& value) override;
  void visit(const Key& key, std::optional<std::int64_t>& value) override;
  void visit(const Key& key, std::string& field) override;
  void visit(const Key& key, std::filesystem::path& field) override;
  void visit(const Key& key, std::vector<int>& field) override;
  void visit(const Key& key, std::vector<std::string>& field) override;
  void visit(const Key& key, std::span<double> fields) override;
  void visit(const Key& key, KeyPairs& field) override;

 private:
  friend class TomlFile;
  struct State;
  explicit TomlTable(std::shared_ptr<State> state);

  std::shared_ptr<State> state_;
};

/// A parsed TOML file and its faults so far.
class TomlFile {
 public:
  /// Fails with one fault if the file cannot be parsed: unreadable, too large, or not TOML.
  static Result<TomlFile, Faults> open(const std::filesystem::path& path);
  TomlFile(TomlFile&&) noexcept;
  TomlFile& operator=(TomlFile&&) noexcept;
  ~TomlFile();

  TomlTable root();
  const Faults& faults() const;
  /// Adds the faults of a file that this one names.
  void add(const Faults& faults);

 private:
  friend class TomlTable;
  struct Document;
  explicit TomlFile(std::unique_ptr<Document> document);

  std::unique_ptr<Document> document_;
};

}  // namespace mocap::settings
