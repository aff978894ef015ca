#include <memory>
#include <random>
#include <string>

#include "base/expects.h"
#include "bridges/natnet/command.h"
#include "bridges/natnet/packets.h"
#include "bridges/natnet/request.h"
#include "fuzz/fuzz_arguments.h"

// Fuzzes what a hostile NatNet client reaches: the reader of requests, the commands, and the encoders under the
// settings that the commands made. Inputs are valid requests with bytes changed, removed and repeated, and random
// bytes. Each packet is copied to a memory block of its exact size, so that the address sanitizer detects reads beyond
// its end.
//
// usage: natnet_fuzz [COUNT [SEED]]

namespace mocap::natnet {
namespace {

std::size_t below(std::mt19937_64& random, std::size_t end) { return end == 0 ? 0 : random() % end; }

constexpr const char* kCommands[] = {"Bitstream,4.1.0.0",
                                     "FrameRate",
                                     "SetProperty,,Labeled Markers,false",
                                     "SetProperty,,Skeleton Coordinates,Local",
                                     "SetProperty,,Bone Naming Convention,FBX",
                                     "SetProperty,,Up Axis,Z-Axis",
                                     "GetProperty,,Up Axis",
                                     "SubscribeToData,RigidBody,all",
                                     "SubscribeToData,Skeleton,actor",
                                     "SubscribeByID,RigidBody,1",
                                     "SubscribeToData",
                                     "SetRecordTakeName,take"};

std::string valid_packet(std::mt19937_64& random) {
  constexpr std::uint8_t kMessages[] = {0, 2, 2, 2, 2, 4, 9, 10, 12, 14, 100};
  std::string packet(4, '\0');
  packet[0] = static_cast<char>(kMessages[below(random, std::size(kMessages))]);
  if (packet[0] == 2) packet += kCommands[below(random, std::size(kCommands))];
  if (packet[0] == 12) packet.append(8, 'e');
  if (packet[0] == 0) packet.append(below(random, 2) == 0 ? 264 : 269, static_cast<char>(below(random, 6)));
  return packet;
}

std::string damaged_packet(std::mt19937_64& random) {
  std::string packet = valid_packet(random);
  for (std::size_t times = below(random, 6); times > 0 && !packet.empty(); --times) {
    const std::size_t place = below(random, packet.size());
    switch (below(random, 4)) {
      case 0: packet[place] = static_cast<char>(random()); break;
      case 1: packet.resize(place); break;
      case 2: packet.insert(place, packet, place, below(random, 40)); break;
      default: packet.insert(place, 1, ',');
    }
  }
  if (below(random, 8) == 0) {
    packet.resize(below(random, 5));
    for (std::size_t n = below(random, 400); n > 0; --n) packet.push_back(static_cast<char>(random()));
  }
  return packet;
}

Scene two_subjects() {
  Scene scene;
  for (const std::size_t bones : {1U, 3U}) {
    Model model;
    model.name = bones == 1 ? "wand" : "actor";
    model.id = static_cast<std::int32_t>(scene.models.size()) + 1;
    model.bones.resize(bones);
    for (std::size_t i = 1; i < bones; ++i) model.bones[i].parent = static_cast<int>(i) - 1;
    model.markers.resize(2);
    model.poses.resize(bones);
    model.marker_poses.resize(2);
    scene.models.push_back(model);
  }
  scene.unlabelled.resize(3);
  return scene;
}

}  // namespace
}  // namespace mocap::natnet

int main(int argc, char** argv) {
  using namespace mocap::natnet;  // NOLINT: the program
  const mocap::fuzz::Arguments arguments(argc, argv);
  std::mt19937_64 random(arguments.seed);
  const Scene scene = two_subjects();
  PacketWriter writer;
  Settings settings;
  unsigned long executed = 0;
  for (std::uint64_t tries = 0; tries < arguments.count; ++tries) {
    if (tries % 100 == 0) settings = Settings{};
    const std::string packet = damaged_packet(random);
    const std::unique_ptr<char[]> exact(new char[packet.size()]);
    packet.copy(exact.get(), packet.size());
    const auto request = read_request({exact.get(), packet.size()});
    if (!request) continue;
    if (request->wanted) settings.version = nearest(*request->wanted);
    MOCAP_EXPECTS(settings.version >= kOldest && settings.version <= kNewest);
    if (request->message != Message::Request) continue;
    const Answer answer = execute(request->text, settings, {.rate_hz = 120.0F, .changeable = below(random, 8) != 0});
    if (answer == Answer(kDone)) ++executed;
    MOCAP_EXPECTS(!frame_packet(writer, scene, settings, tries).empty());
    MOCAP_EXPECTS(!models_packet(writer, scene, settings).empty());
  }
  arguments.print("packets");
  return executed > 0 ? 0 : 1;
}
