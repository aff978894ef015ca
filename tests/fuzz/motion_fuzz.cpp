#include <string>

#include "base/expects.h"
#include "fuzz/fuzz_arguments.h"
#include "fuzz/inputs.h"
#include "lib/simworld/trc_file.h"
#include "scene/bvh.h"
#include "scene/c3d.h"

// Fuzzes the readers of recorded motion: C3D, TRC and BVH. Each file must be read or refused with a reason; what is
// read is finite, has as many samples as it says, and is not many times larger than the file.
//
// usage: motion_fuzz [COUNT [SEED]]

namespace mocap::scene {
namespace {

using fuzz::Inputs;

// A sample of a C3D file takes at least 8 bytes, one of a TRC file at least 2.
void check(const Result<C3d>& clip, std::size_t file_bytes) {
  if (!clip) {
    MOCAP_EXPECTS(!clip.error().message.empty());
    return;
  }
  MOCAP_EXPECTS(clip->rate_hz > 0.0 && clip->frames > 0);
  MOCAP_EXPECTS(clip->samples.size() == clip->frames * clip->labels.size());
  MOCAP_EXPECTS(clip->samples.size() <= file_bytes);
  for (const C3dSample& sample : clip->samples) MOCAP_EXPECTS(sample.position_m.allFinite());
  MOCAP_EXPECTS(kinds_of(clip->labels).size() == clip->labels.size());
}

void check(const Result<Bvh>& bvh) {
  if (!bvh) {
    MOCAP_EXPECTS(!bvh.error().message.empty());
    return;
  }
  MOCAP_EXPECTS(bvh->values.size() == bvh->frames * bvh->values_a_frame);
  BvhPosture posture;
  for (const double t_s : {0.0, 0.4 * bvh->frame_time_s, 1e9}) {
    posture_of(*bvh, t_s, posture);
    MOCAP_EXPECTS(posture.rotations.size() == bvh->joints.size());
  }
}

}  // namespace
}  // namespace mocap::scene

int main(int argc, char** argv) {
  using namespace mocap;         // NOLINT: the program
  using namespace mocap::scene;  // NOLINT: the program
  const fuzz::Arguments arguments(argc, argv);
  const std::string seeds = "tests/fuzz/seeds/motion";
  fuzz::Inputs c3d(fuzz::Inputs::Kind::Binary, arguments.seed, fuzz::files_in(seeds, ".c3d"));
  fuzz::Inputs trc(fuzz::Inputs::Kind::Text, arguments.seed + 1, fuzz::files_in(seeds, ".trc"));
  fuzz::Inputs bvh(fuzz::Inputs::Kind::Text, arguments.seed + 2, fuzz::files_in(seeds, ".bvh"));
  for (std::uint64_t i = 0; i < arguments.count; ++i) {
    const fuzz::Exact file(c3d.next());
    check(parse_c3d(file.bytes()), file.text().size());
    const std::string table = trc.next();
    check(simworld::parse_trc(table), table.size());
    check(parse_bvh(fuzz::Exact(bvh.next()).text()));
  }
  arguments.print("files of each format");
  return 0;
}
