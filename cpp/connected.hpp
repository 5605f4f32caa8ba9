// What hangs together. shapes/topology.py is its face.
#pragma once

#include <cstdint>

namespace partwright {

// Which component each of `nodes` nodes is of, where each of `groups` groups of `size` nodes hangs together. Components are
// numbered by their first nodes.
void connected(const int64_t* groups, int64_t count, int64_t size, int64_t nodes, int64_t* component);

}  // namespace partwright
