#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "base/result.h"
#include "base/time.h"
#include "take/mcap/records.h"

namespace mocap::take {

/// The name of the metadata record of a take. A file may have several; the last one counts.
inline constexpr const char* kTakeMetadata = "take";

/// The metadata of a take: its name, what an operator notes about it, and when it was recorded.
struct TakeInfo {
  std::string name;
  std::string slate;
  std::uint32_t number = 0;  ///< take number of the slate; 0: none
  std::string notes;
  std::vector<std::string> tags;
  std::optional<int> rating;            ///< 0 to 5
  std::string producer;                 ///< program and version
  Duration utc_minus_host{};            ///< at the start; the times of the file are host times plus this
  std::optional<Timestamp> started_at;  ///< host clock
  std::optional<Timestamp> ended_at;    ///< nothing: the recording did not end
  std::string start_timecode;           ///< HH:MM:SS:FF, or ; before the frames if drop-frame; empty: none
  std::string end_timecode;
  bool repaired = false;  ///< the recording was cut off, and its index was written later
  mcap::Texts others;     ///< keys that this version does not know; they are kept
};

inline constexpr int kMaxRating = 5;

/// A key of `others`: number of the first set that the daemon fused in the run of the take. A take that has this set
/// began with the run, so that tracking it again gives the same snapshots.
inline constexpr const char* kFirstSetOfRun = "first_set_of_run";

/// Largest total of the texts but `others`. It leaves space for `others` in mcap::kMaxLastMetadata_bytes.
inline constexpr std::size_t kMaxInfo_bytes = 12 * 1024;

/// Fails with InvalidArgument if a text has control characters other than newlines in notes, if the texts exceed
/// kMaxInfo_bytes, or if the rating is out of range.
Status check(const TakeInfo& info);

/// A text of others as notes of a take: bytes that are not UTF-8 become '?', CR LF a newline, and each other control
/// character a space.
std::string plain_text(const std::string& text);

mcap::Metadata encode(const TakeInfo& info);

/// Whether a recording that a full disk has ended can write the info (mcap::kMaxLastMetadata_bytes).
bool fits_on_a_full_disk(const TakeInfo& info);

/// Bytes that are not UTF-8, of versions that did not check the texts, become '?'. Fails with InvalidArgument if a
/// number cannot be read.
Result<TakeInfo> decode_info(const mcap::Metadata& metadata);

/// "2026-03-01T12:00:00.123456789Z".
std::string utc_text(Timestamp at, Duration utc_minus_host);

}  // namespace mocap::take
