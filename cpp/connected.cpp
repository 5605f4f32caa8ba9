#include "connected.hpp"

#include <numeric>
#include <utility>

namespace partwright {

void connected(const int64_t* groups, int64_t count, int64_t size, int64_t nodes, int64_t* component) {
  // Until the end a node's entry is another one of its component that comes before it, or itself.
  std::iota(component, component + nodes, int64_t{0});
  const auto first = [component](int64_t node) {
    while (component[node] != node) node = component[node] = component[component[node]];
    return node;
  };
  for (int64_t g = 0; g < count; ++g) {
    int64_t one = first(groups[g * size]);
    for (int64_t i = 1; i < size; ++i) {
      int64_t other = first(groups[g * size + i]);
      if (other < one) std::swap(one, other);
      component[other] = one;
    }
  }
  int64_t components = 0;
  for (int64_t node = 0; node < nodes; ++node)
    component[node] = component[node] == node ? components++ : component[component[node]];
}

}  // namespace partwright
