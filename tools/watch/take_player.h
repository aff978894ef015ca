#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <optional>

#include "base/result.h"
#include "base/time.h"
#include "take/take_reader.h"
#include "wire/zmq_subscriber.h"

namespace mocap::watch {

enum class PlayPace {
  Recorded,  ///< each message at its recorded distance from the first, on the host's clock
  AtOnce,
};

/// Gives the messages of a take as a feed: description, snapshots, health.
class TakePlayer {
 public:
  /// Fails as TakeReader::open does.
  static Result<TakePlayer> open(const std::filesystem::path& take, PlayPace pace);

  /// The next message. Fails with Timeout if it is not due within `patience`, with EndOfStream after the last one, and
  /// with another code for each unreadable part of the take (the next message may be valid): first for the parts that
  /// open() found damaged, because a take without a valid index is read from its begin then.
  Result<wire::FeedMessage> next(Duration patience);

 private:
  TakePlayer(std::unique_ptr<take::TakeReader> take, PlayPace pace);
  bool wait_until_due(Timestamp at, Duration patience);

  std::unique_ptr<take::TakeReader> take_;  // keeps its address, which the cursor needs
  std::size_t named_damages_ = 0;
  take::TakeCursor cursor_;
  PlayPace pace_;
  std::optional<take::TakeRecord> coming_;
  std::optional<Timestamp> started_at_;  // on the host's clock
  Timestamp first_at_;                   // of the recording
};

}  // namespace mocap::watch
