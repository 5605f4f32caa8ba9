#include "sample_blocks.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "parallel.hpp"

namespace partwright {
namespace {

struct Place {
  std::array<float, 3> at;
  int64_t index;
};

// Halves across the longest side of their box, at a whole number of blocks; returns how many the first half has.
int64_t halve(Place* places, int64_t count) {
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
  return middle;
}

// Halved until each piece is one block, all pieces of a size at a time.
void split(Place* places, int64_t count, int threads) {
  std::vector<std::pair<int64_t, int64_t>> pieces{{0, count}}, halves;
  while (!pieces.empty()) {
    pieces.erase(std::remove_if(pieces.begin(), pieces.end(), [](auto piece) { return piece.second <= BLOCK; }), pieces.end());
    halves.resize(2 * pieces.size());
    parallel_for(int64_t(pieces.size()), threads, [&](int64_t i) {
      const auto [first, many] = pieces[size_t(i)];
      const int64_t middle = halve(places + first, many);
      halves[size_t(2 * i)] = {first, middle};
      halves[size_t(2 * i + 1)] = {first + middle, many - middle};
    });
    pieces.swap(halves);
  }
}

}  // namespace

SampleBlocks::SampleBlocks(const Samples& given, bool compact, int threads)
    : blocks_(size_t((given.count + BLOCK - 1) / BLOCK)), count_(given.count), background_(given.background), threads_(threads) {
  std::vector<Place> places(static_cast<size_t>(given.count));
  for (int64_t i = 0; i < given.count; ++i)
    places[size_t(i)] = {{given.points[3 * i], given.points[3 * i + 1], given.points[3 * i + 2]}, i};
  if (compact) split(places.data(), given.count, threads);
  in_pieces([&](int64_t b) {
    SampleBlock& block = blocks_[size_t(b)];
    const Place* mine = &places[size_t(b) * BLOCK];
    const int n = int(std::min<int64_t>(BLOCK, given.count - b * BLOCK));
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
  });
}

void SampleBlocks::sharpen(float beta) {
  beta_ = beta;
  in_pieces([&](int64_t b) { occupancy(blocks_[size_t(b)].distance, beta, blocks_[size_t(b)].target); });
}

template <typename Work>
void SampleBlocks::in_pieces(Work work) {
  parallel_for(piece_count(count_), threads_, [&](int64_t piece) {
    const auto [first, last] = piece_range(count_, piece);
    for (int64_t b = first; b < last; ++b) work(b);
  });
}

}  // namespace partwright
