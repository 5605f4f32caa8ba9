#include "compact_samples.hpp"

#include <algorithm>
#include <array>
#include <limits>

namespace partwright {
namespace {

struct Place {
  std::array<float, 3> at;
  int64_t index;
};

// Halves across the longest side of their box, at a whole number of blocks, until each is one block.
void split(Place* places, int64_t count) {
  if (count <= BLOCK) return;
  std::array<float, 3> low, high;
  low.fill(std::numeric_limits<float>::infinity());
  high.fill(-std::numeric_limits<float>::infinity());
  for (int64_t i = 0; i < count; ++i)
    for (size_t axis = 0; axis < 3; ++axis) {
      low[axis] = std::min(low[axis], places[i].at[axis]);
      high[axis] = std::max(high[axis], places[i].at[axis]);
    }
  size_t longest = 0;
  for (size_t axis = 1; axis < 3; ++axis)
    if (high[axis] - low[axis] > high[longest] - low[longest]) longest = axis;
  const int64_t middle = (count + 2 * BLOCK - 1) / (2 * BLOCK) * BLOCK;
  std::nth_element(places, places + middle, places + count,
                   [longest](const Place& a, const Place& b) { return a.at[longest] < b.at[longest]; });
  split(places, middle);
  split(places + middle, count - middle);
}

}  // namespace

CompactSamples::CompactSamples(const Samples& given) {
  std::vector<Place> places(static_cast<size_t>(given.count));
  for (int64_t i = 0; i < given.count; ++i)
    places[size_t(i)] = {{given.points[3 * i], given.points[3 * i + 1], given.points[3 * i + 2]}, i};
  split(places.data(), given.count);
  for (const Place& place : places) {
    points_.insert(points_.end(), place.at.begin(), place.at.end());
    distance_.push_back(given.distance[place.index]);
    weight_.push_back(given.weight[place.index]);
    if (given.background) background_.push_back(given.background[place.index]);
  }
}

Samples CompactSamples::samples() const {
  return {points_.data(), distance_.data(), weight_.data(), background_.empty() ? nullptr : background_.data(),
          int64_t(distance_.size())};
}

}  // namespace partwright
