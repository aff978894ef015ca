#include "lib/benchmark/point_noise.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <utility>

#include "lib/benchmark/duplicates.h"
#include "scene/random.h"

namespace mocap::benchmark {
namespace {

using Eigen::Vector3d;
using scene::Random;

constexpr double kGhostPresent = 8.0 / 9.0 * 8.0 / 9.0 * 8.0 / 9.0;
constexpr double kUniformGap_s = 0.5;
constexpr double kSolverSigma = 0.1, kMostOfAFrame = 0.2, kSolverShift_m = 0.3;
constexpr double kStudioHidden = 0.0065;  // mean of the observed 0.5 to 0.8 %

// Each kind of noise has random numbers of its own, so that one kind does not change with the settings of another.
enum class Stream : std::uint64_t { Hidden = 1, Ghosts, Cuts, Gaps, Order, Frames };

Random random_of(Stream stream, std::uint64_t seed) {
  return Random(scene::mixed(seed) + static_cast<std::uint64_t>(stream));
}

std::size_t below(Random& random, std::size_t bound) {
  return std::min(bound - 1, static_cast<std::size_t>(random.uniform() * static_cast<double>(bound)));
}

double exponential(Random& random, double mean) { return -mean * std::log(1.0 - random.uniform()); }

// Mean of studio_gap_frames, by the midpoint rule.
double mean_studio_gap() {
  constexpr int kSteps = 10'000;
  double sum = 0.0;
  for (int i = 0; i < kSteps; ++i) sum += studio_gap_frames((i + 0.5) / kSteps);
  return sum / kSteps;
}

// Frame after frame, whether each marker is visible.
class Visibility {
 public:
  explicit Visibility(const LabelledClip& clip) : markers_(clip.take.markers), visible_(clip.take.places_m.size()) {
    for (std::size_t i = 0; i < visible_.size(); ++i) visible_[i] = clip.take.places_m[i].allFinite();
  }

  bool at(std::size_t frame, std::size_t marker) const { return visible_[frame * markers_ + marker]; }

  void hide_in_each_frame(int least, int most, Random random) {
    for (std::size_t frame = 0; frame < frames(); ++frame) {
      std::vector<std::size_t> seen;
      for (std::size_t m = 0; m < markers_; ++m) {
        if (at(frame, m)) seen.push_back(m);
      }
      auto left = static_cast<std::size_t>(least) + below(random, static_cast<std::size_t>(most - least + 1));
      for (; left > 0 && !seen.empty(); --left) {
        const std::size_t one = below(random, seen.size());
        visible_[frame * markers_ + seen[one]] = false;
        seen.erase(seen.begin() + static_cast<std::ptrdiff_t>(one));
      }
    }
  }

  // Each marker is visible for an exponential time and then hidden for `gap(random)` frames, from the stationary state.
  template <class Gap>
  void hide_in_gaps(double share, double mean_gap, Random random, Gap gap) {
    const double mean_visible = mean_gap * (1.0 - share) / share;
    for (std::size_t m = 0; m < markers_; ++m) {
      bool visible = random.uniform() >= share;
      double left = visible ? exponential(random, mean_visible) : random.uniform() * gap(random);
      for (std::size_t frame = 0; frame < frames(); ++frame, left -= 1.0) {
        while (left <= 0.0) {
          visible = !visible;
          left += visible ? exponential(random, mean_visible) : gap(random);
        }
        if (!visible) visible_[frame * markers_ + m] = false;
      }
    }
  }

 private:
  std::size_t frames() const { return markers_ == 0 ? 0 : visible_.size() / markers_; }

  std::size_t markers_;
  std::vector<bool> visible_;
};

void add_markers(const LabelledClip& clip, const Duplicates& duplicates, const Visibility& visibility,
                 std::size_t frame, NoisyFrame& into) {
  const auto places_m = clip.take.frame(frame);
  for (std::size_t m = 0; m < places_m.size(); ++m) {
    if (!visibility.at(frame, m)) continue;
    into.points.push_back({places_m[m], static_cast<int>(m), duplicates.markers[frame * places_m.size() + m]});
  }
}

void add_others(const LabelledClip& clip, const Duplicates& duplicates, std::size_t frame, NoisyFrame& into) {
  for (std::size_t i = 0; i < clip.other.size(); ++i) {
    const std::size_t at = frame * clip.other.size() + i;
    if (!clip.others_m[at].allFinite()) continue;
    into.points.push_back({clip.others_m[at], NoisyPoint::kNobodys, duplicates.others[at]});
  }
}

// Hides points of markers, and makes ghosts of others far from their markers.
void hide_and_shift(double sigma, Random& random, NoisyFrame& frame) {
  const double share = std::min(std::abs(sigma * random.normal()), kMostOfAFrame);
  std::vector<NoisyPoint> kept;
  for (NoisyPoint point : frame.points) {
    const double chance = random.uniform();
    if (chance < share) continue;
    if (chance < 2.0 * share) {
      for (Eigen::Index axis = 0; axis < 3; ++axis) {
        point.position_m[axis] += kSolverShift_m * (2.0 * random.uniform() - 1.0);
      }
      point.marker = NoisyPoint::kNobodys;
      point.is_duplicate = false;
    }
    kept.push_back(point);
  }
  frame.points = std::move(kept);
}

struct Spread {
  Vector3d median = Vector3d::Zero(), deviation = Vector3d::Zero();
};

std::optional<Spread> spread_of(const std::vector<NoisyPoint>& points) {
  std::vector<Vector3d> markers_m;
  for (const NoisyPoint& point : points) {
    if (point.marker != NoisyPoint::kNobodys) markers_m.push_back(point.position_m);
  }
  if (markers_m.size() < 2) return std::nullopt;
  Spread spread;
  const auto count = static_cast<double>(markers_m.size());
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    std::vector<double> values;
    for (const Vector3d& at_m : markers_m) values.push_back(at_m[axis]);
    std::ranges::sort(values);
    spread.median[axis] = values[(values.size() - 1) / 2];
    const double mean = std::accumulate(values.begin(), values.end(), 0.0) / count;
    double squares = 0.0;
    for (const double value : values) squares += (value - mean) * (value - mean);
    spread.deviation[axis] = std::sqrt(squares / (count - 1.0));
  }
  return spread;
}

void add_ghosts(int channels, Random& random, NoisyFrame& into) {
  const std::optional<Spread> spread = spread_of(into.points);
  for (int channel = 0; channel < channels; ++channel) {
    const bool present = random.uniform() < kGhostPresent;
    const Vector3d off(random.normal(), random.normal(), random.normal());
    if (!present || !spread) continue;
    into.points.push_back({spread->median + spread->deviation.cwiseProduct(off), NoisyPoint::kNobodys});
  }
}

// Cuts happen in different frames, each of a visible marker.
void add_cuts(int cuts, Random random, std::vector<NoisyFrame>& frames) {
  std::vector<std::size_t> left;
  for (std::size_t frame = 2; frame + 1 < frames.size(); ++frame) left.push_back(frame);
  for (int cut = 0; cut < cuts && !left.empty(); ++cut) {
    const std::size_t one = below(random, left.size());
    NoisyFrame& frame = frames[left[one]];
    left.erase(left.begin() + static_cast<std::ptrdiff_t>(one));
    std::vector<Vector3d> markers_m;
    for (const NoisyPoint& point : frame.points) {
      if (point.marker != NoisyPoint::kNobodys) markers_m.push_back(point.position_m);
    }
    if (!markers_m.empty()) frame.cut_m.push_back(markers_m[below(random, markers_m.size())]);
  }
}

// Fisher and Yates.
void shuffle(std::vector<NoisyPoint>& points, Random& random) {
  for (std::size_t left = points.size(); left > 1; --left) std::swap(points[left - 1], points[below(random, left)]);
}

}  // namespace

std::optional<PointNoise> noise_named(std::string_view name) {
  PointNoise noise;
  if (name == "none") return noise;
  if (name == "soma" || name == "cuts50" || name == "hidden5") {
    noise.hidden_min = name == "hidden5" ? 5 : 0;
    noise.hidden_max = name == "hidden5" ? 5 : 4;
    noise.ghost_channels = 3;
    noise.cuts = name == "cuts50" ? 50 : 0;
    return noise;
  }
  if (name == "studio") noise.studio_share = kStudioHidden;
  if (name == "uniform10") noise.uniform_share = 0.1;
  if (name == "uniform30") noise.uniform_share = 0.3;
  if (name == "solver") noise.frame_sigma = kSolverSigma;
  if (noise.studio_share == 0.0 && noise.uniform_share == 0.0 && noise.frame_sigma == 0.0) return std::nullopt;
  return noise;
}

double studio_gap_frames(double share) {
  static constexpr std::array<std::pair<double, double>, 5> kQuantiles{
      {{0.0, 1.0}, {0.5, 6.0}, {0.9, 115.0}, {0.99, 420.0}, {1.0, 800.0}}};
  std::size_t next = 1;
  while (next + 1 < kQuantiles.size() && share >= kQuantiles[next].first) ++next;
  const auto& [from, least] = kQuantiles[next - 1];
  const auto& [to, most] = kQuantiles[next];
  return std::exp(std::lerp(std::log(least), std::log(most), (share - from) / (to - from)));
}

std::vector<NoisyFrame> add_noise(const LabelledClip& clip, const PointNoise& noise, std::uint64_t seed) {
  Visibility visibility(clip);
  const Random gaps = random_of(Stream::Gaps, seed);
  if (noise.studio_share > 0.0) {
    visibility.hide_in_gaps(noise.studio_share, mean_studio_gap(), gaps,
                            [](Random& random) { return std::round(studio_gap_frames(random.uniform())); });
  }
  if (noise.uniform_share > 0.0) {
    const double gap = std::max(1.0, kUniformGap_s * clip.rate_hz);
    visibility.hide_in_gaps(noise.uniform_share, gap, gaps, [gap](Random&) { return gap; });
  }
  visibility.hide_in_each_frame(noise.hidden_min, noise.hidden_max, random_of(Stream::Hidden, seed));

  Random ghosts = random_of(Stream::Ghosts, seed), shares = random_of(Stream::Frames, seed);
  const Duplicates duplicates = find_duplicates(clip);
  std::vector<NoisyFrame> frames(clip.frames());
  for (std::size_t frame = 0; frame < frames.size(); ++frame) {
    add_markers(clip, duplicates, visibility, frame, frames[frame]);
    if (noise.frame_sigma > 0.0) hide_and_shift(noise.frame_sigma, shares, frames[frame]);
    add_others(clip, duplicates, frame, frames[frame]);
    add_ghosts(noise.ghost_channels, ghosts, frames[frame]);
  }
  add_cuts(noise.cuts, random_of(Stream::Cuts, seed), frames);
  Random order = random_of(Stream::Order, seed);
  for (NoisyFrame& frame : frames) shuffle(frame.points, order);
  return frames;
}

std::vector<NoisyFrame> reversed(const std::vector<NoisyFrame>& frames) {
  std::vector<NoisyFrame> turned(frames.rbegin(), frames.rend());
  for (NoisyFrame& frame : turned) frame.cut_m.clear();
  for (std::size_t i = 0; i < turned.size(); ++i) {
    const NoisyFrame& from = frames[frames.size() - 1 - i];
    for (const Vector3d& cut_m : from.cut_m) {
      const auto cut = std::ranges::find(from.points, cut_m, &NoisyPoint::position_m);
      if (cut == from.points.end()) continue;
      for (std::size_t next = i + 1; next < turned.size(); ++next) {
        const auto point = std::ranges::find(turned[next].points, cut->marker, &NoisyPoint::marker);
        if (point == turned[next].points.end()) continue;
        turned[next].cut_m.push_back(point->position_m);
        break;
      }
    }
  }
  return turned;
}

}  // namespace mocap::benchmark
