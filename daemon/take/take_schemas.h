#pragma once

#include <google/protobuf/descriptor.h>

#include <string>

namespace mocap::take {

/// The schema of a Protobuf message as MCAP wants it: a serialised FileDescriptorSet of the message's file and of all
/// files that it imports, imported files first.
std::string schema_of(const google::protobuf::Descriptor& message);

}  // namespace mocap::take
