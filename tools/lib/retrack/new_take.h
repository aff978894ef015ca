#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "base/time.h"
#include "lib/retrack/set_source.h"
#include "model/blob.h"
#include "model/description.h"
#include "model/snapshot.h"
#include "take/take_quality.h"
#include "take/take_reader.h"
#include "take/take_writer.h"

namespace mocap::retrack {

/// The part of a take from `from` to `to`, on the host's clock of the recording; both included.
struct Span {
  Timestamp from = Timestamp::min();
  Timestamp to = Timestamp::max();

  bool has(Timestamp at) const { return at >= from && at <= to; }
};

/// Writes a take that is tracked again: its new snapshots, and the images, health and events of the recording within a
/// span.
class NewTake {
 public:
  /// Creates the file. Fails as TakeWriter::create does.
  static Result<NewTake> create(const std::filesystem::path& path, const take::TakeReader& from, const Span& span,
                                Description description, std::vector<TakeFile> files);

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

  /// Writes quality and index. Returns the path.
  Result<std::string> finish();

 private:
  NewTake(std::unique_ptr<take::TakeWriter> writer, take::TakeInfo info, const Span& span, Description description);

  std::unique_ptr<take::TakeWriter> writer_;
  take::TakeInfo info_;
  Span span_;
  Description description_;
  bool described_ = true;  // the file has the description
  take::TakeMeter meter_;
  v1::Snapshot message_;
  std::string bytes_;
};

}  // namespace mocap::retrack
