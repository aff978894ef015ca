#include "export/fbx_document.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <string>

namespace mocap::exports {
namespace {

constexpr std::int64_t kTicksPerSecond = 46186158000;  // KTime of the FBX SDK

// FbxTime::EMode of a frame rate.
struct TimeMode {
  Rate rate;
  std::int32_t mode;
};
constexpr std::array<TimeMode, 13> kTimeModes{{{{24, 1}, 11},
                                               {{24000, 1001}, 13},
                                               {{25, 1}, 10},
                                               {{30, 1}, 6},
                                               {{30000, 1001}, 9},
                                               {{48, 1}, 5},
                                               {{50, 1}, 4},
                                               {{60, 1}, 3},
                                               {{60000, 1001}, 17},
                                               {{72, 1}, 16},
                                               {{96, 1}, 15},
                                               {{100, 1}, 2},
                                               {{120, 1}, 1}}};
constexpr std::int32_t kCustomTimeMode = 14;

std::int32_t time_mode(const Rate& rate) {
  for (const TimeMode& known : kTimeModes) {
    if (known.rate.numerator * rate.denominator == known.rate.denominator * rate.numerator) {
      return known.mode;
    }
  }
  return kCustomTimeMode;
}

}  // namespace

std::int64_t fbx_ticks(const Rate& rate, std::size_t frame) {
  const std::int64_t scaled = static_cast<std::int64_t>(frame) * rate.denominator;
  const std::int64_t seconds = scaled / rate.numerator;
  const double rest = static_cast<double>(scaled % rate.numerator) / static_cast<double>(rate.numerator);
  return seconds * kTicksPerSecond + std::llround(rest * static_cast<double>(kTicksPerSecond));
}

FbxNode fbx_header(const Clip& clip) {
  FbxNode node("FBXHeaderExtension");
  node.field("FBXHeaderVersion", 1003).field("FBXVersion", kFbxVersion).field("EncryptionType", 0);
  node.child(FbxNode("CreationTimeStamp"))
      .field("Version", 1000)
      .field("Year", 1970)
      .field("Month", 1)
      .field("Day", 1)
      .field("Hour", 10)
      .field("Minute", 0)
      .field("Second", 0)
      .field("Millisecond", 0);
  node.field("Creator", clip.producer);
  FbxNode& info = node.child(FbxNode("SceneInfo"));
  info.add(std::string("GlobalInfo") + '\0' + '\1' + "SceneInfo").add("UserData");
  info.field("Type", "UserData").field("Version", 100);
  info.child(FbxNode("MetaData"))
      .field("Version", 100)
      .field("Title", clip.name)
      .field("Subject", "")
      .field("Author", "")
      .field("Keywords", "")
      .field("Revision", "")
      .field("Comment",
             fmt::format("first frame {}, {}/{} Hz", clip.first_frame, clip.rate.numerator, clip.rate.denominator));
  info.child(FbxProperties()
                 .text("Original|ApplicationName", clip.producer)
                 .text("LastSaved|ApplicationName", clip.producer)
                 .node());
  return node;
}

FbxNode fbx_global_settings(const Clip& clip) {
  FbxNode node("GlobalSettings");
  node.field("Version", 1000);
  node.child(FbxProperties()
                 .integer("UpAxis", 1)
                 .integer("UpAxisSign", 1)
                 .integer("FrontAxis", 2)
                 .integer("FrontAxisSign", 1)
                 .integer("CoordAxis", 0)
                 .integer("CoordAxisSign", 1)
                 .integer("OriginalUpAxis", 1)
                 .integer("OriginalUpAxisSign", 1)
                 .number("UnitScaleFactor", 1.0)
                 .number("OriginalUnitScaleFactor", 1.0)
                 .colour("AmbientColor", 0.0, 0.0, 0.0)
                 .text("DefaultCamera", "Producer Perspective")
                 .enumeration("TimeMode", time_mode(clip.rate))
                 .enumeration("TimeProtocol", 2)
                 .enumeration("SnapOnFrameMode", 0)
                 .time("TimeSpanStart", 0)
                 .time("TimeSpanStop", fbx_ticks(clip.rate, clip.frames - 1))
                 .number("CustomFrameRate", clip.rate.hz())
                 .node());
  return node;
}

FbxNode fbx_documents(const Clip& clip) {
  FbxNode node("Documents");
  node.field("Count", 1);
  FbxNode& document = node.child(FbxNode("Document"));
  document.add(std::int64_t{999'999}).add("Scene").add("Scene");
  document.child(FbxProperties().object("SourceObject").text("ActiveAnimStackName", clip.name).node());
  document.field("RootNode", std::int64_t{0});
  return node;
}

FbxNode fbx_takes(const Clip& clip) {
  const std::int64_t end = fbx_ticks(clip.rate, clip.frames - 1);
  FbxNode node("Takes");
  node.field("Current", clip.name);
  FbxNode& take = node.child(FbxNode("Take"));
  take.add(clip.name).field("FileName", clip.name + ".tak");
  take.child(FbxNode("LocalTime")).add(std::int64_t{0}).add(end);
  take.child(FbxNode("ReferenceTime")).add(std::int64_t{0}).add(end);
  return node;
}

}  // namespace mocap::exports
