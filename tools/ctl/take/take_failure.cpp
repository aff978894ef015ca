#include "ctl/take/take_failure.h"

#include <fmt/format.h>

#include <cstdio>

#include "base/exit_codes.h"
#include "lib/cli/shown_text.h"

namespace mocap::ctl {

Error cannot_read(Error error) {
  if (error.code == ErrorCode::Io) error.code = ErrorCode::InvalidArgument;
  return error;
}

int report_take_failure(const Error& error) {
  fmt::print(stderr, "mocapctl: {}\n", cli::shown_lines(error.message));
  switch (error.code) {
    case ErrorCode::NotFound: return kExitNoInput;
    case ErrorCode::Io: return kExitCannotWrite;
    default: return kExitData;
  }
}

}  // namespace mocap::ctl
