#include "ctl/take/export_formats.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string>

#include "export/bvh.h"
#include "export/c3d.h"
#include "export/csv.h"
#include "export/fbx.h"
#include "export/gltf.h"
#include "export/trc.h"
#include "export/usd.h"
#include "model/bounds.h"

namespace mocap::ctl {
namespace {

using exports::Axes, exports::Unit, exports::Clip, exports::Sink, exports::WriteOptions;

// The writers of skeletons expect a frame, a subject and bones.
Status check_skeletons(const Clip& clip) {
  if (clip.frames == 0 || clip.subjects.empty()) return Error{ErrorCode::InvalidArgument, "the take is empty"};
  for (const exports::ClipSubject& subject : clip.subjects) {
    if (!subject.subject.marker_set.skeleton.bones.empty()) continue;
    return Error{ErrorCode::InvalidArgument,
                 fmt::format("subject '{}' has no bones; export the others with --subject", subject.subject.name)};
  }
  return {};
}

Status write_bvh(const Clip& clip, const WriteOptions& options, const Sink& sink) {
  if (const Status fits = check_skeletons(clip); !fits) return fits;
  return sink(exports::write_bvh(clip, 0, {options.names, exports::per_metre(options.unit)}));
}

Status write_usd(const Clip& clip, const WriteOptions& options, const Sink& sink) {
  if (const Status fits = check_skeletons(clip); !fits) return fits;
  return sink(exports::write_usd(clip, options.names));
}

template <Result<std::string> (*write)(const Clip&, exports::BoneNames)>
Status write_binary(const Clip& clip, const WriteOptions& options, const Sink& sink) {
  if (const Status fits = check_skeletons(clip); !fits) return fits;
  const Result<std::string> bytes = write(clip, options.names);
  return bytes ? sink(*bytes) : bytes.error();
}

}  // namespace

std::span<const ExportFormat> export_formats() {
  constexpr Axes z = Axes::ZUp, y = Axes::YUp;
  constexpr Unit m = Unit::Metre, cm = Unit::Centimetre, mm = Unit::Millimetre;
  constexpr std::size_t all = kMaxSubjects, marks = exports::kMaxC3dEvents;
  // clang-format off
  static const std::array kFormats{
      ExportFormat{"c3d", "c3d", "markers, events", {z, y}, {mm, m, cm}, all, marks, exports::write_c3d},
      ExportFormat{"trc", "trc", "markers, for OpenSim", {y, z}, {mm, m, cm}, all, 0, exports::write_trc},
      ExportFormat{"csv", "csv", "markers and bones", {z, y}, {m, mm, cm}, all, 0, exports::write_csv},
      ExportFormat{"bvh", "bvh", "skeleton of one subject", {y}, {cm, m, mm}, 1, 0, write_bvh},
      ExportFormat{"gltf", "glb", "skeletons", {y}, {m}, all, 0, write_binary<exports::write_gltf>},
      ExportFormat{"usd", "usda", "skeletons", {y}, {m}, all, 0, write_usd},
      ExportFormat{"fbx", "fbx", "skeletons", {y}, {cm}, all, 0, write_binary<exports::write_fbx>},
  };
  // clang-format on
  return kFormats;
}

const ExportFormat* format_named(std::string_view name) {
  const auto found = std::ranges::find_if(
      export_formats(), [&](const ExportFormat& format) { return format.name == name || format.extension == name; });
  return found == export_formats().end() ? nullptr : &*found;
}

}  // namespace mocap::ctl
