#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <variant>
#include <vector>

#include "base/result.h"
#include "base/time.h"
#include "chaos/fault.h"
#include "chaos/faulty_cameras.h"

namespace mocap::corpus {

/// The exposure at 0 s of the simulated worlds (SceneWorld).
inline constexpr Timestamp kFirstExposure{std::chrono::seconds(1)};

/// What an operator, a cable or a disk does to the daemon.
enum class OrderKind : std::uint8_t {
  Lose,         ///< the link of a camera is down
  Reset,        ///< a subject is forgotten
  Away,         ///< a subject is removed
  Back,         ///< and comes back
  ReloadSame,   ///< the configuration is read again, unchanged
  ReloadLabel,  ///< with another setting of [label]
  ReloadAlign,  ///< with another patience of [align]
  TakeStart,    ///< a take starts `amount` seconds before
  TakeStop,
  TakeNext,
  TakeCancel,
  TakeCut,   ///< a power failure: `amount` is the share of the take's file that is left
  DiskFull,  ///< `amount` bytes are free
  DiskFree,
  FolderGone,  ///< the folder of the takes is removed
};

struct Order {
  OrderKind kind = OrderKind::Lose;
  std::uint32_t target = 0;  ///< camera or subject; 0 for the other kinds
  double amount = 0.0;

  friend bool operator==(const Order&, const Order&) = default;
};

/// One input of the daemon, at the time at which the daemon handles it.
struct Input {
  Timestamp at;
  std::variant<chaos::Arrival, Order> what;
};

/// The true position of one marker.
struct TrueMarker {
  std::uint8_t subject = 0;
  std::uint8_t marker = 0;
  float position_m[3] = {0, 0, 0};
};

/// The true positions at one exposure.
struct Truth {
  Timestamp at;
  std::vector<TrueMarker> markers;
};

/// A recording of the corpus: all inputs of the daemon's steps in their order, and the truth at some of the exposures.
struct Recording {
  std::string about;                ///< the faults, or the source of the motion, for people
  std::vector<std::string> bodies;  ///< by subject: name of a file in `world/subjects` or `world/markersets`
  double rate_hz = 0.0;
  bool utc_stamps = false;
  Duration patience{};                    ///< [align] patience
  std::uint64_t seed = 1;                 ///< of the messages that the link of the feed loses and cuts
  std::vector<chaos::Fault> feed_faults;  ///< of the publisher and of the link to its subscriber
  std::vector<Input> inputs;
  std::vector<Truth> truths;
};

/// Writes a recording as an MCAP file: topics `image` (mocap.v1.CameraBlobs, of which exposed_at_ns is the camera's
/// stamp and detected_at_ns the arrival of the first byte), `order` ("lose 2 0") and `truth`, and metadata `corpus`.
/// The time of a message is the one at which the daemon handles it. An existing file is refused.
Status write_recording(const std::filesystem::path& path, const Recording& recording);

/// Reads such a file. Fails with InvalidArgument, naming file and fault.
Result<Recording> read_recording(const std::filesystem::path& path);

}  // namespace mocap::corpus
