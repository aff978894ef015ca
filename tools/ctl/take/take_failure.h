#pragma once

#include "base/result.h"

namespace mocap::ctl {

/// The error of reading a file, for report_take_failure(): Io, which there is an error of writing, is InvalidArgument.
Error cannot_read(Error error);

/// Prints why a new take or a file of one was not made. Returns the exit code: 66 no such file, 73 (Io) cannot be
/// written, else 65.
int report_take_failure(const Error& error);

}  // namespace mocap::ctl
