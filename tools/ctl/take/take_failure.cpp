#include "ctl/take/take_failure.h"

#include <fmt/format.h>

#include <cstdio>

#include "base/exit_codes.h"

namespace mocap::ctl {

int report_take_failure(const Error& error) {
  fmt::print(stderr, "mocapctl: {}\n", error.message);
  switch (error.code) {
    case ErrorCode::NotFound: return kExitNoInput;
    case ErrorCode::Io: return kExitCannotWrite;
    default: return kExitData;
  }
}

}  // namespace mocap::ctl
