#pragma once

#include "base/result.h"

namespace mocap::ctl {

/// Prints why a new take or a file of one was not made. Returns the exit code: 66 no such file, 73 cannot be written,
/// else 65.
int report_take_failure(const Error& error);

}  // namespace mocap::ctl
