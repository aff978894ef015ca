#include "paper_study/quality.h"

#include <cmath>
#include <numeric>

#include "paper_study/follow.h"
#include "paper_study/methods.h"
#include "paper_study/see.h"

namespace mocap::paper_study {
namespace {

constexpr double kSigmasOf99Percent = 2.5758;

double mean_of(std::span<const double> values) {
  return values.empty() ? 0.0 : std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

/// Losses and errors of one method over the clips of a situation.
struct Gathered {
  int losses = 0;
  std::vector<double> kept_px, all_px;

  void add(const Followed& followed) {
    all_px.insert(all_px.end(), followed.errors_px.begin(), followed.errors_px.end());
    if (followed.lost) {
      ++losses;
    } else {
      kept_px.insert(kept_px.end(), followed.errors_px.begin(), followed.errors_px.end());
    }
  }
};

}  // namespace

ErrorFigures figures_of(std::span<const double> kept_px, std::span<const double> all_px) {
  ErrorFigures figures;
  figures.samples = kept_px.size();
  figures.mean = mean_of(kept_px);
  figures.mean_all = mean_of(all_px);
  double squares = 0.0;
  for (const double error : kept_px) squares += (error - figures.mean) * (error - figures.mean);
  const double n = static_cast<double>(kept_px.size());
  const double half = n < 2.0 ? 0.0 : kSigmasOf99Percent * std::sqrt(squares / (n - 1.0) / n);
  figures.low = figures.mean - half;
  figures.high = figures.mean + half;
  return figures;
}

std::vector<SituationQuality> judge(const QualitySettings& settings, std::span<const Situation> situations,
                                    const std::function<void(int done)>& progress) {
  Viewer viewer;
  std::vector<SituationQuality> all;
  int done = 0;
  for (const Situation situation : situations) {
    std::vector<Gathered> gathered(methods().size());
    for (int i = 0; i < settings.clips; ++i) {
      const std::uint64_t seed = clip_seed(settings.seed_base, situation, static_cast<std::size_t>(i));
      const Clip clip = make_clip(situation, seed);
      const Sightings sightings = viewer.see(clip);
      for (std::size_t m = 0; m < methods().size(); ++m) {
        const Method& method = methods()[m];
        gathered[m].add(
            follow(*method.make({.seed = seed}), clip, method.paper_detector ? sightings.paper : sightings.ours));
      }
      progress(++done);
    }
    SituationQuality quality{situation, {}};
    for (std::size_t m = 0; m < methods().size(); ++m) {
      quality.methods.push_back(
          {methods()[m].name, gathered[m].losses, figures_of(gathered[m].kept_px, gathered[m].all_px)});
    }
    all.push_back(std::move(quality));
  }
  return all;
}

}  // namespace mocap::paper_study
