#include "wire/role.h"

namespace mocap::wire {

const char* name_of(Role role) noexcept { return role == Role::Operator ? "operator" : "viewer"; }

}  // namespace mocap::wire
