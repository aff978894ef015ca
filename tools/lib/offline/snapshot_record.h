#pragma once

#include <string>
#include <string_view>

#include "base/result.h"
#include "model/snapshot.h"

namespace mocap::offline {

/// Appends a part of a record behind its length.
void put(std::string_view part, std::string& record);

/// Takes the first part off a record. Precondition: there is one.
std::string_view next_part(std::string_view& record);

/// A snapshot as bytes, and back; covariances are lost.
std::string bytes_of(const Snapshot& snapshot);
Result<Snapshot> snapshot_of(std::string_view bytes);

}  // namespace mocap::offline
