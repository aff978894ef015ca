#include "calibration/wand/watch_wand.h"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>
#include <utility>

#include "calibration/wand/emptiest_part.h"
#include "geometry/lens.h"

namespace mocap::calibration {
namespace {

// Two cameras that share fewer samples are not related by them.
constexpr std::size_t kLeastPairs = 60;

}  // namespace

WandWatch::WandWatch(Rig rig, Wand wand, const WandWatchSettings& settings)
    : rig_(std::move(rig)),
      wand_(std::move(wand)),
      settings_(settings),
      shape_(wand_shape(settings.lens_known)),
      cameras_(rig_.size()),
      pairs_(rig_.size() * rig_.size(), 0) {}

void WandWatch::add(std::size_t camera, const Picture& picture) {
  Camera& own = cameras_[camera];
  const CameraModel& model = rig_[camera];
  ++own.pictures;
  flat_.clear();
  index_.clear();
  for (std::size_t i = 0; i < picture.spots.size(); ++i) {
    const auto ray = geometry::undistort(model.lens, picture.spots[i].at);
    if (!ray) continue;
    flat_.push_back(ray->v * model.lens.fx_px);
    index_.push_back(i);
  }
  const WandLook look = find_wand(flat_, wand_, shape_);
  if (!look.seen) return;
  for (std::size_t m = 0; m < wand_.marks_m.size(); ++m) {
    const Eigen::Vector2d& at = picture.spots[index_[static_cast<std::size_t>(look.spots[m])]].at.v;
    const int x = static_cast<int>(kFields * at.x() / model.width_px);
    const int y = static_cast<int>(kFields * at.y() / model.height_px);
    ++own.fields[static_cast<std::size_t>(std::clamp(y, 0, kFields - 1) * kFields + std::clamp(x, 0, kFields - 1))];
  }
  own.seen.emplace_back(picture.exposed_at, false);
  for (std::size_t other = 0; other < cameras_.size(); ++other) {
    if (other == camera) continue;
    auto& theirs = cameras_[other].seen;
    const auto from = std::ranges::lower_bound(theirs, picture.exposed_at - settings_.most_skew, {},
                                               &std::pair<Timestamp, bool>::first);
    if (from == theirs.end() || from->first > picture.exposed_at + settings_.most_skew) continue;
    ++pairs_[camera * cameras_.size() + other];
    ++pairs_[other * cameras_.size() + camera];
    for (auto [one, of] : {std::pair{&own.seen.back(), &own}, std::pair{&*from, &cameras_[other]}}) {
      of->shared += one->second ? 0 : 1;
      one->second = true;
    }
  }
}

std::vector<bool> WandWatch::joined() const {
  const std::size_t n = cameras_.size();
  std::vector<bool> in(n, false);
  if (n == 0) return in;
  std::vector<std::size_t> open{0};
  in[0] = true;
  while (!open.empty()) {
    const std::size_t at = open.back();
    open.pop_back();
    for (std::size_t to = 0; to < n; ++to) {
      if (in[to] || pairs_[at * n + to] < kLeastPairs) continue;
      in[to] = true;
      open.push_back(to);
    }
  }
  return in;
}

WandSeen WandWatch::seen(std::size_t camera) const {
  const Camera& own = cameras_[camera];
  const auto marked = std::ranges::count_if(own.fields, [](std::uint32_t field) { return field > 0; });
  WandSeen seen;
  seen.pictures = own.pictures;
  seen.samples = own.seen.size();
  seen.shared = own.shared;
  seen.coverage = static_cast<double>(marked) / (kFields * kFields);
  seen.missing = emptiest_part(own.fields, kFields);
  seen.joined = joined()[camera];
  return seen;
}

bool WandWatch::is_enough(const WandSeen& camera) const {
  return camera.joined && camera.shared >= settings_.enough_samples &&
         (camera.coverage >= settings_.enough_coverage || camera.shared >= settings_.settled_samples);
}

bool WandWatch::enough() const {
  for (std::size_t c = 0; c < cameras_.size(); ++c) {
    if (!is_enough(seen(c))) return false;
  }
  return !cameras_.empty();
}

std::string WandWatch::advice() const {
  std::size_t worst = cameras_.size();
  double least = 1e9;
  for (std::size_t c = 0; c < cameras_.size(); ++c) {
    const WandSeen one = seen(c);
    if (is_enough(one)) continue;
    const double done = static_cast<double>(one.shared) + 100.0 * one.coverage + (one.joined ? 1000.0 : 0.0);
    if (done >= least) continue;
    least = done;
    worst = c;
  }
  if (worst == cameras_.size()) return {};
  const WandSeen one = seen(worst);
  const std::string& name = rig_[worst].name;
  if (one.samples == 0) return fmt::format("{} has not seen the wand yet", name);
  if (one.shared < settings_.enough_samples || !one.joined)
    return fmt::format("wave where {} and another camera look: {} of {} samples", name, one.shared,
                       settings_.enough_samples);
  return fmt::format("wave in {} of {}'s image: {:.0f} % covered", one.missing.empty() ? "more" : one.missing, name,
                     100.0 * one.coverage);
}

}  // namespace mocap::calibration
