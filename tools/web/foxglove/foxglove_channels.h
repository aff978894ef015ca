#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "mocap/v1/description.pb.h"

namespace mocap::web {

/// The kind of data of a channel of the Foxglove protocol.
enum class ChannelContent { Bones, Scene, Cameras, Image };

/// One channel of the Foxglove protocol.
struct Channel {
  std::uint32_t id = 0;
  std::string topic;  ///< "/tf", "/scene", "/tf/cameras", "/preview/NAME"
  ChannelContent content = ChannelContent::Scene;
  std::string source;  ///< topic of the feed
  std::string camera;  ///< of an image
};

/// The channels of one client: bones, scene and cameras always, an image for each camera of the description. A channel
/// keeps its id as long as the client is connected.
class Channels {
 public:
  Channels();

  /// What a new description changes, as messages of the protocol to the client.
  std::vector<std::string> update(const v1::Description& description);

  /// The message that offers all channels.
  std::string advertisement() const;
  /// nullptr: there is no such channel.
  const Channel* find(std::uint32_t id) const;

 private:
  std::uint32_t id_of(const std::string& topic);

  std::map<std::string, std::uint32_t> ids_;  // by topic, also of channels that are gone
  std::map<std::uint32_t, Channel> channels_;
};

}  // namespace mocap::web
