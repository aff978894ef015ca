#include "cameras/node/node_settings.h"

#include <fmt/format.h>

#include "wire/endpoint.h"

namespace mocap::cameras {

void declare_keys(KeyVisitor& keys, NodeCameraSettings& camera) {
  keys.text("endpoint", camera.endpoint,
            {.help = "[node] endpoint of the node, as this machine reaches it",
             .example = "tcp://127.0.0.1:5575",
             .required = "the [node] endpoint of the node"});
  keys.text("camera", camera.camera, {.help = "name of the camera on the node; \"\": the same name"});
  keys.text("server_key", camera.server_key,
            {.help = "public key of the node, or a file with it (its [security] server_key); \"\": no keys"});
  keys.path("secret_key", camera.secret_key,
            {.help = "file with this machine's own key pair (mocapctl keys new), which the node allows"});
  keys.flag("allow_remote", camera.allow_remote,
            {.help = "true: blobs of another machine are accepted although no key proves which machine sent them"});
  keys.flag("recorded", camera.recorded,
            {.help = "true: the node plays a recording, whose times are valid as they are; no image is dropped"});
  keys.number("rate_hz", camera.rate_hz, {0, 10000},
              {.help = "images per second, for the announced rate of the feed; 0: unknown"});
}

std::vector<KeyFault> faults_of(const NodeCameraSettings& camera) {
  if (camera.server_key.empty() != camera.secret_key.empty()) {
    return {
        {camera.server_key.empty() ? "server_key" : "secret_key",
         "server_key and secret_key go together: the node's public key, and this machine's own key pair; see mocapctl "
         "keys --help"}};
  }
  if (camera.endpoint.ends_with(":*")) {
    return {{"endpoint", fmt::format("endpoint is '{}', expected a port number", camera.endpoint)}};
  }
  if (const Status shape = wire::check_endpoint(camera.endpoint, true); !shape) {
    return {{"endpoint", shape.error().message}};
  }
  if (camera.server_key.empty() && !camera.allow_remote && !wire::is_local(camera.endpoint)) {
    return {{"endpoint",
             fmt::format("endpoint '{}' is another machine and no key proves which machine sends; set server_key and "
                         "secret_key (mocapctl keys), or allow_remote = true",
                         camera.endpoint)}};
  }
  return {};
}

CameraFacts facts_of(const NodeCameraSettings& camera, const std::string& camera_name) {
  CameraFacts facts;
  if (camera.rate_hz > 0.0) facts.rate_hz = camera.rate_hz;
  if (!camera.endpoint.empty()) {
    facts.device = {
        {"camera", fmt::format("{} of {}", camera.camera.empty() ? camera_name : camera.camera, camera.endpoint)}};
  }
  facts.recorded_time = camera.recorded;
  return facts;
}

}  // namespace mocap::cameras
