#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "base/result.h"
#include "bodyfit/fit_subject.h"
#include "model/skeleton.h"
#include "scene/c3d.h"

namespace mocap::ctl {

/// Reads a C3D file. Fails with the reason: NotFound, Unsupported (byte order) or InvalidArgument.
Result<scene::C3d> read_c3d(const std::filesystem::path& path);

struct StreamTakes {
  bodyfit::LabelledTake at_rest;
  bodyfit::LabelledTake moving;
};

/// Reads the measured markers of one subject from a recorded feed (JSON lines). Sets in which the subject is tracked go
/// to `at_rest` for `rest_s` seconds from the first one on, the others to `moving`. An incomplete last line is ignored.
/// Fails with NotFound, or with InvalidArgument and the line.
Result<StreamTakes> read_stream(const std::filesystem::path& path, std::uint32_t subject, const MarkerSet& set,
                                double rest_s);

}  // namespace mocap::ctl
