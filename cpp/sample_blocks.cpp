#include "sample_blocks.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "parallel.hpp"

namespace partwright {
namespace {

constexpr int64_t LEAST_SPLIT = 1 << 11;  // samples of a thread: to split less is done before one is awake

struct Place {
  std::array<float, 3> at;
  int64_t index;
};

// Halves across the longest side of their box, at a whole number of blocks, until each is one block.
void split(Place* places, int64_t count, int threads) {
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
  const int half_of_them = std::max(1, threads / 2);
  parallel_for(2, worth_their_while(threads, count, LEAST_SPLIT), [&](int64_t half) {
    half ? split(places + middle, count - middle, half_of_them) : split(places, middle, half_of_them);
  });
}

}  // namespace

SampleBlocks::SampleBlocks(const Samples& given, bool compact, int threads)
    : blocks_(size_t((given.count + BLOCK - 1) / BLOCK)), count_(given.count), background_(given.background) {
  std::vector<Place> places(static_cast<size_t>(given.count));
  for (int64_t i = 0; i < given.count; ++i)
    places[size_t(i)] = {{given.points[3 * i], given.points[3 * i + 1], given.points[3 * i + 2]}, i};
  if (compact) split(places.data(), given.count, thread_count(threads));
  for (size_t b = 0; b < blocks_.size(); ++b) {
    SampleBlock& block = blocks_[b];
    const Place* mine = &places[b * BLOCK];
    const int n = int(std::min<int64_t>(BLOCK, given.count - int64_t(b) * BLOCK));
    for (int i = 0; i < BLOCK; ++i) {
      const Place& place = mine[i < n ? i : 0];
      block.at.x[i] = place.at[0];
      block.at.y[i] = place.at[1];
      block.at.z[i] = place.at[2];
      block.distance[i] = given.distance[place.index];
      block.root[i] = i < n ? std::sqrt(given.weight[place.index]) : 0.f;
      block.background[i] = given.background ? given.background[place.index] : 0.f;
    }
    block.heaviest = *std::max_element(block.root, block.root + BLOCK);
    block.ball = around(block.at);
  }
}

void SampleBlocks::sharpen(float beta) {
  beta_ = beta;
  for (SampleBlock& block : blocks_) occupancy(block.distance, beta, block.target);
}

}  // namespace partwright
