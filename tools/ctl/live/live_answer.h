#pragma once

#include "mocap/v1/control.pb.h"

namespace mocap::ctl {

/// Prints the answer of the daemon to standard output: as JSON, a list of shots as CSV if `csv`, or for people.
void print_answer(const v1::Answer& answer, bool json, bool csv);

}  // namespace mocap::ctl
