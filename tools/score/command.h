#pragma once

namespace mocap::score {

// The subcommands of mocap-score.
int run_score(int argc, const char* const* argv);
int run_labels(int argc, const char* const* argv);
int run_skeleton(int argc, const char* const* argv);

}  // namespace mocap::score
