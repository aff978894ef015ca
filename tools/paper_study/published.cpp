#include "paper_study/published.h"

namespace mocap::paper_study {
namespace {

constexpr int kLosses[5][3] = {{3, 0, 0}, {9, 0, 4}, {4, 1, 2}, {7, 6, 8}, {9, 11, 16}};

constexpr ErrorFigures kErrors[3][3] = {
    {{1445, 6.67, 7.21, 7.75, 0.0}, {1700, 9.71, 10.31, 10.91, 0.0}, {1700, 38.51, 39.18, 39.83, 0.0}},
    {{594, 9.77, 10.81, 11.84, 0.0}, {1080, 14.03, 14.98, 15.93, 0.0}, {864, 38.77, 40.02, 41.27, 0.0}},
    {{1360, 2.86, 3.17, 3.48, 0.0}, {1615, 5.50, 5.98, 6.47, 0.0}, {1530, 21.82, 22.67, 23.51, 0.0}}};

constexpr OriginalCode kOriginalCode[5][3] = {{{2.7, 0.8, 7.34}, {0.0, 0.0, 11.75}, {0.3, 0.5, 39.0}},
                                              {{7.6, 1.8, 11.1}, {0.0, 0.0, 16.7}, {5.6, 1.2, 43.4}},
                                              {{5.6, 1.5, 3.09}, {0.0, 0.0, 5.25}, {3.1, 1.4, 23.7}},
                                              {{8.1, 1.1, 0.0}, {7.2, 1.2, 0.0}, {8.9, 1.3, 0.0}},
                                              {{11.0, 1.1, 0.0}, {9.7, 1.7, 0.0}, {9.5, 1.6, 0.0}}};

constexpr std::array<CostRow, 7> kCosts[3] = {{{{1, {0.043, 0.046, 0.053, 0.077}},
                                                {5, {0.064, 0.067, 0.084, 0.104}},
                                                {10, {0.086, 0.091, 0.110, 0.116}},
                                                {15, {0.109, 0.113, 0.126, 0.218}},
                                                {20, {0.130, 0.140, 0.155, 0.221}},
                                                {25, {0.136, 0.164, 0.184, 0.211}},
                                                {30, {0.168, 0.194, 0.214, 0.274}}}},
                                              {{{1, {0.067, 0.077, 0.100, 0.126}},
                                                {5, {0.120, 0.130, 0.148, 0.174}},
                                                {10, {0.172, 0.175, 0.195, 0.268}},
                                                {15, {0.226, 0.234, 0.256, 0.331}},
                                                {20, {0.293, 0.296, 0.314, 0.386}},
                                                {25, {0.338, 0.356, 0.376, 0.453}},
                                                {30, {0.409, 0.418, 0.445, 0.503}}}},
                                              {{{1, {0.134, 0.146, 0.162, 0.180}},
                                                {5, {0.387, 0.499, 0.529, 0.801}},
                                                {10, {0.824, 0.950, 1.017, 1.095}},
                                                {15, {0.958, 1.384, 1.423, 1.604}},
                                                {20, {1.285, 1.842, 1.920, 2.116}},
                                                {25, {1.560, 1.934, 2.333, 2.427}},
                                                {30, {1.886, 2.105, 2.791, 2.812}}}}};

std::optional<std::size_t> index_of(Situation situation) {
  for (std::size_t i = 0; i < kStudied.size(); ++i) {
    if (kStudied[i] == situation) return i;
  }
  return std::nullopt;
}

}  // namespace

std::optional<int> published_losses(Situation situation, std::size_t method) {
  const auto index = index_of(situation);
  if (!index) return std::nullopt;
  return kLosses[*index][method];
}

std::optional<ErrorFigures> published_errors(Situation situation, std::size_t method) {
  const auto index = index_of(situation);
  if (!index || *index >= std::size(kErrors)) return std::nullopt;
  return kErrors[*index][method];
}

std::optional<OriginalCode> original_code(Situation situation, std::size_t method) {
  const auto index = index_of(situation);
  if (!index) return std::nullopt;
  return kOriginalCode[*index][method];
}

std::span<const CostRow> published_costs(std::size_t method) { return kCosts[method]; }

}  // namespace mocap::paper_study
