#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "base/time.h"
#include "model/blob.h"
#include "model/description.h"
#include "model/health.h"
#include "model/snapshot.h"
#include "model/take/take_file.h"
#include "module/recording_size.h"
#include "take/mcap/writer.h"
#include "take/take_info.h"

namespace mocap::take {

// Topics of a take.
inline constexpr std::string_view kDescriptionTopic = "description";
inline constexpr std::string_view kSnapshotTopic = "snapshot";
inline constexpr std::string_view kBlobsTopics = "blobs/";  ///< followed by the name of the camera
inline constexpr std::string_view kHealthTopic = "health";
inline constexpr std::string_view kEventTopic = "event";

/// The content of a take from its start on.
struct TakeStart {
  TakeInfo info;  ///< `started_at` and `utc_minus_host` are required
  Description description;
  std::vector<TakeFile> files;
};

/// Writes one take: an MCAP file with the topics above, whose times are UTC.
///
/// A crash, a power cut or a full disk loses at most the messages of the last 100 ms of the recording, if `tick` is
/// called at least every 50 ms or messages arrive without a pause. Every call may wait for the disk. After a failure
/// each later call returns the same error; `finish` still completes the file if it can (mcap::Writer). One thread owns
/// a TakeWriter.
class TakeWriter {
 public:
  /// Creates the file and writes info, description and files. An existing file is kept, and the new one has a number in
  /// its name (OutputFile::create). Fails with Io, and with InvalidArgument (an info that `check` refuses, a path that
  /// does not end in .mcap, over kMaxCameras cameras or two cameras of one name).
  static Result<std::unique_ptr<TakeWriter>> create(const std::filesystem::path& path, const TakeStart& start,
                                                    mcap::WriterSettings settings = {});
  ~TakeWriter();

  /// Appends an encoded message of a topic above. `at`: on the host's clock. Fails with Io and InvalidArgument (another
  /// topic, a time before 1970).
  Status append(std::string_view topic, Timestamp at, std::string_view message);

  Status append(const Snapshot& snapshot);
  /// Precondition: the description has the camera.
  Status append(const BlobFrame& frame);
  /// The description that the next snapshots refer to.
  Status append(const Description& description, Timestamp at);
  Status append(const Health& health, Timestamp at);

  /// Adds a file as an attachment. Fails with Io.
  Status attach(const TakeFile& file);

  /// Writes the messages that have waited for 50 ms. For pauses without messages.
  Status tick(Timestamp now);

  /// Writes the final info and the index, and closes the file. If `check` refuses the info, for example because the
  /// timecodes of the end do not fit, the file keeps the texts of its start. Fails with Io if the file could not be
  /// completed, or if an earlier call failed.
  Status finish(const TakeInfo& info);

  const std::string& path() const noexcept { return writer_.path(); }
  RecordingSize size() const noexcept { return writer_.size(); }

 private:
  struct Messages;
  TakeWriter(mcap::Writer writer, TakeInfo info, mcap::WriterSettings settings);
  Status begin(const TakeStart& start);
  Status add_topic(const std::string& topic, std::string_view message_type);
  TakeInfo last_info(const TakeInfo& end) const;
  Status append_to(std::uint16_t channel, Timestamp at, std::string_view message);

  mcap::Writer writer_;
  TakeInfo info_;
  Duration chunk_span_;
  std::map<std::string, std::uint16_t, std::less<>> channels_;  // by topic
  std::map<std::string, std::uint16_t, std::less<>> schemas_;   // by message type
  std::vector<std::uint16_t> blob_channels_;                    // by camera
  std::unique_ptr<Messages> messages_;
};

}  // namespace mocap::take
