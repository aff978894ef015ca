#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "base/result.h"
#include "bodyfit/fit_subject.h"
#include "model/skeleton.h"
#include "scene/c3d.h"

namespace mocap::ctl {

/// Reads a C3D file. Fails with NotFound, or with InvalidArgument and the reason.
Result<scene::C3d> read_c3d(const std::filesystem::path& path);

struct StreamTakes {
  bodyfit::LabelledTake at_rest;
  bodyfit::LabelledTake moving;
};

/// Reads the measured markers of one subject from a recorded feed (JSON lines). The first `rest_s` seconds in which the
/// subject is tracked go to `at_rest`, the others to `moving`. Fails with NotFound, or with InvalidArgument and the
/// line.
Result<StreamTakes> read_stream(const std::filesystem::path& path, std::uint32_t subject, const MarkerSet& set,
                                double rest_s);

}  // namespace mocap::ctl
