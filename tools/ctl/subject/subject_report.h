#pragma once

#include <nlohmann/json.hpp>
#include <vector>

#include "lib/functional/functional_body.h"
#include "settings/subject/subject_file.h"

namespace mocap::ctl {

/// A subject as JSON and as a table on standard output. A length is the distance from the joint of the parent to the
/// joint of the bone. A residual of 0 is unknown.
nlohmann::ordered_json json_of(const settings::SubjectFile& subject);
void print(const settings::SubjectFile& subject);

/// The joints of a body that was found in motion. Prints nothing for none.
nlohmann::ordered_json json_of(const std::vector<functional::FoundJoint>& joints);
void print(const std::vector<functional::FoundJoint>& joints);

}  // namespace mocap::ctl
