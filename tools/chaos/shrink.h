#pragma once

#include <functional>
#include <vector>

#include "chaos/fault.h"

namespace mocap::chaos {

/// Returns a smallest list of faults, in the same order, that still fails: without any one of them it does not.
/// `fails` must hold for `faults`. It is asked at most n^2 + 3 n times for n faults.
///
/// Source: Zeller and Hildebrandt, "Simplifying and isolating failure-inducing input" (2002), the algorithm ddmin.
std::vector<Fault> shrink(std::vector<Fault> faults, const std::function<bool(const std::vector<Fault>&)>& fails);

}  // namespace mocap::chaos
