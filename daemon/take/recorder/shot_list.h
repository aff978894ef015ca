#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/result.h"
#include "model/take/shot.h"
#include "take/take_info.h"

namespace mocap::take {

/// Largest notes of a shot. The rest of the info of a take is for its name and slate (at most 100 bytes each), the
/// producer, and the timecodes (11 bytes each) that are known at the end of the take.
inline constexpr std::size_t kMaxShotNotes_bytes = kMaxInfo_bytes - 1024;

/// Reads a shot list: CSV (RFC 4180) with a header of the columns name, slate, notes, seconds and done in any order;
/// only name is needed. CR LF within notes becomes a newline, another control character a space. Fails with
/// InvalidArgument; the message begins with `file` and the line.
Result<std::vector<Shot>> parse_shots(std::string_view csv, const std::string& file);

/// The text that `parse_shots` reads.
std::string shots_csv(const std::vector<Shot>& shots);

/// Fails with InvalidArgument if the list has too many shots or bytes, or a name twice, if a name or slate cannot be
/// a part of a file name, or if notes have over kMaxShotNotes_bytes or control characters other than newlines.
Status check_shots(const std::vector<Shot>& shots);

/// The shot list of the daemon, in a file that is replaced with each change. One thread owns it.
class ShotList {
 public:
  /// `path`: of the file; empty: the list is not kept.
  explicit ShotList(std::filesystem::path path) : path_(std::move(path)) {}

  /// Reads the file, if there is one. Fails with the fault of the file; the list is then empty.
  Status load();

  const std::vector<Shot>& shots() const noexcept { return shots_; }
  std::size_t left() const noexcept;
  /// The first shot that is not done; null: none.
  const Shot* next() const noexcept;

  /// The number of shots, those left, and the next one, as a sentence for an operator.
  std::string words() const;

  /// Fails with InvalidArgument or Io; the list is then unchanged.
  Status replace(std::vector<Shot> shots);
  /// Does nothing if there is no such shot. If the file cannot be written, the list is changed in memory, and the call
  /// fails with Io.
  Status set_done(const std::string& name, bool done);

 private:
  Status save(const std::vector<Shot>& shots) const;

  std::filesystem::path path_;
  std::vector<Shot> shots_;
};

}  // namespace mocap::take
