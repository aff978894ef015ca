#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "chaos/step_daemon.h"
#include "lib/scoring/frames.h"
#include "model/description.h"
#include "model/snapshot.h"

namespace mocap::chaos {

/// The fault that a check found, in words; nothing: the invariant holds.
using Finding = std::optional<std::string>;

/// Every number of the snapshot is finite, every rotation a unit quaternion.
Finding all_numbers_finite(const Snapshot& snapshot);

/// Each snapshot is exposed later, and has a greater number, than the one before.
Finding time_goes_on(const Snapshot& before, const Snapshot& now);

/// No subject occurs twice, and no 3D track has two labels or has a label and is listed as unlabelled.
Finding labels_are_unique(const Snapshot& snapshot);

/// Markers and bones are those of the description, or the subject has none.
Finding fits_description(const Snapshot& snapshot, const Description& description);

/// Each received image was used, was counted as dropped, or waits in a queue of bounded length. `ended`: none waits.
Finding images_are_counted(const FrameCounts& counts, std::size_t cameras, bool ended);

/// The snapshot is encoded, decoded and encoded again to the same bytes, by both encoders.
Finding snapshot_survives_wire(const Snapshot& snapshot);

/// The same for a description.
Finding description_survives_wire(const Description& description);

/// The steps did not keep memory, apart from `kGrowth_bytes`.
Finding memory_is_bounded(std::int64_t growth_bytes);
inline constexpr std::int64_t kGrowth_bytes = 1 << 20;

/// A take that has ended opens, has an end and no damage.
Finding take_is_whole(const std::filesystem::path& take);

/// The bones of the subject are where they truly are: within `kRight_m` rms of the bones that cameras see. Holds
/// without a judgement if the cameras see too little of the subject.
Finding skeleton_is_right(const Snapshot& snapshot, const scoring::EvalFrame& truth, std::uint32_t subject,
                          std::uint32_t performer);
inline constexpr double kRight_m = 0.06;

}  // namespace mocap::chaos
