#pragma once

#include <string>

#include "base/result.h"
#include "base/time.h"
#include "model/take/take_order.h"
#include "take/recorder/take_folder.h"
#include "take/recorder/take_in_progress.h"
#include "take/recorder/take_intake.h"
#include "take/takes_settings.h"

namespace mocap::take {

/// Begins the file of a take that starts at `at`, less the pre-roll of the order; the intake holds its messages from
/// now on. `slate`: if the order has none. Fails with InvalidArgument if the order cannot be followed, with Io if the
/// file cannot be written; then nothing is held. May wait for the disk.
Result<TakeInProgress> open_take(const TakeOrder& order, Timestamp at, const std::string& slate,
                                 const TakesSettings& settings, const TakeFolder& folder, TakeIntake& intake);

/// Notes the number of the first set of the run, if it came.
void note_first_set(const TakeIntake& intake, TakeInfo& info);

}  // namespace mocap::take
