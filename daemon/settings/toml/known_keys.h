#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "settings/faults.h"

namespace mocap::settings {

/// The keys of one table while the table is read: known, faulty, missing, misspelt. Adds the faults of the table to
/// those of its file, which outlive this object.
class KnownKeys {
 public:
  /// `table` is the place of the table; `who` begins each of its faults, as "camera 'north-east'"; empty: nothing.
  KnownKeys(Faults& faults, Place table, std::string who);

  void call(std::string who) { who_ = std::move(who); }
  const std::string& who() const { return who_; }

  /// Makes the key known.
  void learn(std::string_view key);
  /// Whether the key has a fault.
  bool is_faulty(std::string_view key) const;

  /// Adds the fault "who: message".
  void fault(Place at, std::string_view message);
  /// The same; the key then is faulty.
  void fault(std::string_view key, Place at, std::string_view message);
  /// Adds a fault of a required key that the table does not have, unless `judge` has judged a key that is probably
  /// meant.
  void missing(std::string_view key, std::string_view expected);

  /// Replaces the fault of a missing key by that of `name`, a key of the table, if `name` is not known and probably
  /// misspelt. Returns whether it is.
  bool correct(const std::string& name, Place at);
  /// Adds a fault of `name`, a key of the table, unless `name` is known; otherwise as `correct`.
  void judge(const std::string& name, Place at);

 private:
  // A required key that the table does not have, and the message of its fault.
  struct Missing {
    std::string key, expected, message;
  };

  Faults& faults_;
  Place table_;
  std::string who_;
  std::vector<std::string> known_;
  std::vector<std::string> faulty_;
  std::vector<std::string> unknown_;  // keys that judge() did not know
  std::vector<Missing> missing_;
};

}  // namespace mocap::settings
