#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/key_visitor.h"
#include "base/result.h"
#include "model/image_mask.h"
#include "settings/faults.h"

namespace mocap::settings {

class TomlFile;

/// A table of a TOML file, while it is read. Every key that is asked for is known from then on; `done` makes faults of
/// the others. Copies share what they know. The file outlives it.
class TomlTable final : public KeyVisitor {
 public:
  /// A list of numbers whose length is one of `lengths`, all of them finite. Nothing, and a fault, where it is not;
  /// nothing where the key is absent.
  std::optional<std::vector<double>> list(std::string_view key, std::initializer_list<std::size_t> lengths);

  /// `rows` lists of `columns` finite numbers each, row by row; else as `list`.
  std::optional<std::vector<double>> matrix(std::string_view key, std::size_t rows, std::size_t columns);

  /// A list of polygons, each a list of at least three corners [x, y], px. Nothing, and a fault, where it is not;
  /// nothing where the key is absent.
  std::optional<std::vector<MaskPolygon>> polygons(std::string_view key);

  bool has(std::string_view key) const;
  /// Whether the key's value is a list of lists.
  bool has_matrix(std::string_view key) const;

  /// The sub-table `[key]`; nothing where the key is absent, or (a fault) something else.
  std::optional<TomlTable> table(std::string_view key, std::string who);
  /// The tables of `[[key]]`, in their order.
  std::vector<TomlTable> tables(std::string_view key, std::string_view who);
  /// All keys, in the order of the file.
  std::vector<std::string> keys() const;

  /// Makes the key known without looking at it.
  void ignore(std::string_view key);
  /// A fault if the key is absent; says whether it is there.
  bool require(std::string_view key, std::string_view expected);

  /// A fault at the key's value, or at the table where there is no such key: "who: message".
  void fault(std::string_view key, std::string_view message);
  /// A fault at the table: "who: message".
  void fault(std::string_view message);
  /// The same for broken rules between keys. A rule about a key that has a fault already is left out: its field does
  /// not have the value of the file.
  void add(const std::vector<KeyFault>& faults);

  /// Every key that nobody asked for is a fault.
  void done();

  /// How faults call this table, as "camera 'north-east'"; empty for the file's own keys.
  void call(std::string who);
  /// Calls it "`what` 'VALUE'" if the key is a text that is not empty.
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

/// A parsed TOML file and the faults found in it so far.
class TomlFile {
 public:
  /// Fails with the one fault that kept it from being parsed: unreadable, too large, not TOML.
  static Result<TomlFile, Faults> open(const std::filesystem::path& path);
  TomlFile(TomlFile&&) noexcept;
  TomlFile& operator=(TomlFile&&) noexcept;
  ~TomlFile();

  TomlTable root();
  const Faults& faults() const;
  /// Takes over the faults of a file that this one names.
  void add(const Faults& faults);

 private:
  friend class TomlTable;
  struct Document;
  explicit TomlFile(std::unique_ptr<Document> document);

  std::unique_ptr<Document> document_;
};

}  // namespace mocap::settings
