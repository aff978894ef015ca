#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "base/result.h"
#include "bodyfit/fit_subject.h"
#include "model/skeleton.h"
#include "scene/c3d.h"

namespace mocap::ctl {

Result<scene::C3d> read_c3d(const std::filesystem::path& path);

struct StreamTakes {
  bodyfit::LabelledTake at_rest;
  bodyfit::LabelledTake moving;
};

/// The measured markers of one subject of a recorded feed (JSON lines): those of the first `rest_s` seconds that it is
/// tracked, and those after. Fails with NotFound, or with InvalidArgument and the line.
Result<StreamTakes> read_stream(const std::filesystem::path& path, std::uint32_t subject, const MarkerSet& set,
                                double rest_s);

}  // namespace mocap::ctl
