#pragma once

#include <memory>
#include <vector>

#include "module/take_recorder.h"
#include "take/take_writer.h"
#include "take/takes_settings.h"

namespace mocap::take {

/// Makes the recorder of takes. `files`: what each take carries. Allocates the memory of `before`; logs its size.
std::unique_ptr<TakeRecorder> make_take_recorder(const TakesSettings& settings, const Description& description,
                                                 std::vector<TakeFile> files);

}  // namespace mocap::take
