#pragma once

#include <string>

#include "chaos/seed_batch.h"

namespace mocap::chaos {

/// The failure with what reproduces it: seed, commit, time, step, invariant and the faults.
std::string failure_text(const SeedResult& failing, const std::string& commit);

/// The same as one line of JSON.
std::string failure_json(const SeedResult& failing, const std::string& commit);

/// The commit of the working folder, or the version of the program outside of a clone.
std::string commit_of_tree();

}  // namespace mocap::chaos
