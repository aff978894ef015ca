#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "base/time.h"
#include "lib/retrack/part_take.h"
#include "lib/retrack/set_source.h"
#include "lib/retrack/span.h"
#include "model/blob.h"
#include "model/description.h"
#include "model/snapshot.h"
#include "take/take_quality.h"
#include "take/take_reader.h"

namespace mocap::retrack {

/// A key of the metadata of a take that was tracked again: what it was made of (`made_of`); of a chunk: `origin_of`.
inline constexpr const char* kMadeOf = "retracked_made_of";

/// The content of a new take from its start on.
struct NewTakeStart {
  Description description;
  std::vector<TakeFile> files = {};
  std::string made_of = {};  ///< for kMadeOf; empty: left out
};

/// Writes a take that is tracked again: its new snapshots, and the images, health and events of the recording within a
/// span. See PartTake for its name.
class NewTake {
 public:
  /// Creates the file. Fails as PartTake::create does.
  static Result<NewTake> create(const std::filesystem::path& path, const take::TakeReader& from, const Span& span,
                                NewTakeStart start);

  /// The description that applies from the next snapshot on.
  Status learn(const SubjectFit& fit, Timestamp at);
  /// `recorded`: the snapshot of the take for the same set; stamps that tracking does not give are taken over from it.
  /// The images of the set that are outside of the span, but whose set is in it, are written too. Returns whether both
  /// snapshots are equal, byte for byte.
  Result<bool> append(const Snapshot& snapshot, const TakeSet& set);
  /// An image, if it is in the span.
  Status append(const BlobFrame& frame);
  /// A health report or an event, as it was recorded.
  Status append(std::string_view topic, const take::TakeRecord& record);

  /// Writes quality and index, and gives the file its name. Returns the path. Fails as PartTake::finish does.
  Result<std::string> finish();

 private:
  NewTake(PartTake file, take::TakeInfo info, const Span& span, Description description);

  PartTake file_;
  take::TakeInfo info_;
  Span span_;
  Description description_;
  bool described_ = true;  // the file has the description
  take::TakeMeter meter_;
  v1::Snapshot message_;
  std::string bytes_;
};

}  // namespace mocap::retrack
