#pragma once

#include <string>
#include <vector>

#include "chaos/episode.h"

namespace mocap::corpus {

/// A simulated recording before its simulation.
struct Plan {
  std::string name;
  chaos::Episode episode;
};

/// The plans of all simulated recordings: calm ones, and each kind of fault that mocap-chaos draws. A kind that changes
/// the images or the order of the steps occurs once or twice, a kind of the feed or of takes once.
std::vector<Plan> plans();

/// A recording with the motion of a file of the shared data.
struct MotionPlan {
  std::string name;
  std::string body;    ///< name of the file in `world`
  std::string given;   ///< shipped marker set from which the body is made
  std::string motion;  ///< relative to the shared data
  std::string fit;     ///< static trial to which the body is fitted; empty: the body is `given`
  double first_s = 0.0;
};

std::vector<MotionPlan> motion_plans();

}  // namespace mocap::corpus
