// The Python face of the kernel. Arguments are checked by its callers: fields/kernel.py, fields/profile_distance.py,
// meshing/hulls.py, shapes/distance.py, shapes/topology.py, approximation/half_space.py, approximation/sketches/chains.py, partsdf/part_networks.py.
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/vector.h>

#include <cstring>

#include "beyond_planes.hpp"
#include "chains.hpp"
#include "connected.hpp"
#include "evaluate.hpp"
#include "grid_values.hpp"
#include "hull.hpp"
#include "morphology.hpp"
#include "normal_equations.hpp"
#include "optimise.hpp"
#include "part_networks.hpp"
#include "profile.hpp"
#include "triangle_tree.hpp"

namespace nb = nanobind;
using namespace nb::literals;
using namespace partwright;

namespace {

template <typename T>
using In = nb::ndarray<const T, nb::c_contig, nb::device::cpu>;
template <typename T>
using Out = nb::ndarray<nb::numpy, T>;

template <typename T>
Out<T> array(std::vector<size_t> shape) {
  size_t size = 1;
  for (size_t s : shape) size *= s;
  T* data = new T[std::max<size_t>(size, 1)]();
  nb::capsule owner(data, [](void* p) noexcept { delete[] static_cast<T*>(p); });
  return Out<T>(data, shape.size(), shape.data(), owner);
}

std::vector<Part> parts_of(const In<float>& rows) {
  std::vector<Part> parts(rows.shape(0));
  for (size_t i = 0; i < parts.size(); ++i) parts[i] = prepare(rows.data() + i * COLUMNS);
  return parts;
}

template <typename T>
std::vector<T> copy(const In<T>& a) {
  return std::vector<T>(a.data(), a.data() + a.size());
}

std::vector<char> flags(const In<uint8_t>& a) { return std::vector<char>(a.data(), a.data() + a.size()); }

Samples samples_of(const In<float>& points, const In<float>& distance, const In<float>& weight, const In<float>& background) {
  return {points.data(), distance.data(), weight.data(), background.size() ? background.data() : nullptr,
          int64_t(points.shape(0))};
}

Networks networks_of(const std::vector<In<float>>& weights, const std::vector<In<float>>& shifts) {
  Networks networks{int64_t(weights.front().shape(0)), {int(weights.front().shape(1))}, {}, {}};
  for (size_t l = 0; l < weights.size(); ++l) {
    networks.widths.push_back(int(weights[l].shape(2)));
    networks.weights.push_back(weights[l].data());
    networks.shifts.push_back(shifts[l].data());
  }
  return networks;
}

std::vector<Stage> stages_of(const In<float>& a) {
  std::vector<Stage> stages;
  for (size_t i = 0; i < a.shape(0); ++i) stages.push_back({a.data()[2 * i], int(a.data()[2 * i + 1])});
  return stages;
}

Mesh mesh_of(const In<double>& vertices, const In<int64_t>& faces, const In<int64_t>& edges) {
  return {vertices.data(), faces.data(), edges.data(), int64_t(vertices.shape(0)), int64_t(faces.shape(0)),
          int64_t(edges.shape(0))};
}

Limits limits_of(const In<float>& a) {
  Limits limits;
  std::copy_n(a.data(), DERIVATIVES, limits.lower.begin());
  std::copy_n(a.data() + DERIVATIVES, DERIVATIVES, limits.upper.begin());
  std::copy_n(a.data() + 2 * DERIVATIVES, DERIVATIVES, limits.step.begin());
  return limits;
}

}  // namespace

NB_MODULE(_kernel, m) {
#define PW_VALUE(name) .value(#name, name)
  nb::enum_<Column>(m, "Column", nb::is_arithmetic(), "Columns of a parameter row.") PW_COLUMNS(PW_VALUE);
#undef PW_VALUE
#define PW_VALUE(name) .value(#name, D_##name)
  nb::enum_<Derivative>(m, "Tangent", nb::is_arithmetic(), "Entries of a step, and of derivatives.") PW_TANGENT(PW_VALUE);
#undef PW_VALUE

  m.def("evaluate", [](In<float> rows, In<float> points, int threads) {
    auto out = array<float>({points.shape(0)});
    const auto parts = parts_of(rows);
    nb::gil_scoped_release release;
    evaluate(parts, points.data(), int64_t(points.shape(0)), out.data(), threads);
    return out;
  }, "rows"_a, "points"_a, "threads"_a,
     "Signed distances (N,) of the parts, folded first to last.");

  m.def("evaluate_parts", [](In<float> rows, In<float> points, int threads) {
    auto out = array<float>({rows.shape(0), points.shape(0)});
    const auto parts = parts_of(rows);
    nb::gil_scoped_release release;
    evaluate_parts(parts, points.data(), int64_t(points.shape(0)), out.data(), threads);
    return out;
  }, "rows"_a, "points"_a, "threads"_a,
     "Signed distances (M, N) of each part alone.");

  m.def("covered", [](In<float> rows, In<float> points, int threads) {
    auto out = array<bool>({rows.shape(0), points.shape(0)});
    const auto parts = parts_of(rows);
    nb::gil_scoped_release release;
    covered(parts, points.data(), int64_t(points.shape(0)), reinterpret_cast<uint8_t*>(out.data()), threads);
    return out;
  }, "rows"_a, "points"_a, "threads"_a,
     "Whether each part alone covers each point (M, N).");

  m.def("occupancy_sums", [](In<uint8_t> occupied, In<uint8_t> inside, In<float> weight, int64_t split, int threads) {
    auto out = array<double>({occupied.shape(0), size_t(2), size_t(2)});
    nb::gil_scoped_release release;
    occupancy_sums(occupied.data(), int64_t(occupied.shape(0)), inside.data(), weight.data(), int64_t(weight.shape(0)),
                   split, out.data(), threads);
    return out;
  }, "occupied"_a, "inside"_a, "weight"_a, "split"_a, "threads"_a,
     "Weighted intersection and union of occupancies (K, N) with one (N,), before and from `split` on: (K, 2, 2).");

  m.def("gradients", [](In<float> rows, In<float> points, In<float> upstream, int threads) {
    auto out = array<double>({rows.shape(0), size_t(DERIVATIVES)});
    const auto parts = parts_of(rows);
    nb::gil_scoped_release release;
    gradients(parts, points.data(), upstream.data(), int64_t(points.shape(0)), out.data(), threads);
    return out;
  }, "rows"_a, "points"_a, "upstream"_a, "threads"_a,
     "Derivatives (M, len(Tangent)) of sum(upstream * distance).");

  m.def("normal_equations", [](In<float> rows, In<uint8_t> live, In<float> points, In<float> distance, In<float> weight,
                               In<float> background, float beta, float overlap, float blending, int threads) {
    const size_t n = rows.shape(0) * DERIVATIVES;
    auto matrix = array<double>({n, n});
    auto gradient = array<double>({n});
    NormalEquations system;
    {
      nb::gil_scoped_release release;
      const auto parts = parts_of(rows);
      SampleBlocks samples(samples_of(points, distance, weight, background), false);
      samples.sharpen(beta);
      PartDistances distances(parts.size(), samples);
      measure(parts, samples, threads, distances);
      system = normal_equations(parts, flags(live), samples, {overlap, blending}, threads, distances);
    }
    std::copy(system.gradient.begin(), system.gradient.end(), gradient.data());
    for (const auto& [pair, block] : system.blocks)
      for (int r = 0; r < DERIVATIVES; ++r)
        for (int c = 0; c < DERIVATIVES; ++c) {
          const size_t i = size_t(pair.first) * DERIVATIVES + r, j = size_t(pair.second) * DERIVATIVES + c;
          matrix.data()[i * n + j] = matrix.data()[j * n + i] = block[r * DERIVATIVES + c];
        }
    return nb::make_tuple(system.loss, gradient, matrix);
  }, "rows"_a, "live"_a, "points"_a, "distance"_a, "weight"_a, "background"_a,
     "beta"_a, "overlap"_a, "blending"_a, "threads"_a,
     "Loss, J^T r and J^T J of the weighted residuals; those of parts that are not live stay 0.");

  m.def("loss", [](In<float> rows, In<float> points, In<float> distance, In<float> weight, In<float> background, float beta,
                   float overlap, float blending, int threads) {
    nb::gil_scoped_release release;
    const auto parts = parts_of(rows);
    SampleBlocks samples(samples_of(points, distance, weight, background), false);
    samples.sharpen(beta);
    PartDistances distances(parts.size(), samples);
    return loss(parts, std::vector<char>(parts.size(), 1), samples, {overlap, blending}, threads, distances);
  }, "rows"_a, "points"_a, "distance"_a, "weight"_a, "background"_a, "beta"_a, "overlap"_a, "blending"_a,
     "threads"_a,
     "Half the sum of squared residuals.");

  m.def("levenberg_marquardt", [](In<float> rows, In<uint8_t> free, In<uint8_t> tied, In<float> points, In<float> distance,
                                  In<float> weight, In<float> background, In<float> stages, float overlap, float blending,
                                  In<float> limits, int threads) {
    auto out = array<float>({rows.shape(0), size_t(COLUMNS)});
    Outcome outcome;
    {
      nb::gil_scoped_release release;
      outcome = levenberg_marquardt(copy(rows), flags(free), flags(tied), samples_of(points, distance, weight, background),
                                    stages_of(stages), {overlap, blending}, limits_of(limits), threads);
    }
    std::copy(outcome.rows.begin(), outcome.rows.end(), out.data());
    return nb::make_tuple(out, outcome.loss, outcome.iterations);
  }, "rows"_a, "free"_a, "tied"_a, "points"_a, "distance"_a, "weight"_a, "background"_a,
     "stages"_a, "overlap"_a, "blending"_a, "limits"_a, "threads"_a,
     "Rows, loss and iterations after all stages, pairs of beta and iterations.");

  m.def("fit_starts", [](In<float> starts, In<int64_t> first, In<int64_t> last, In<uint8_t> free, In<uint8_t> tied,
                         In<float> points, In<float> distance, In<float> weight, In<float> background, In<float> stages,
                         float overlap, float blending, In<float> limits, int threads) {
    auto out = array<float>({starts.shape(0), size_t(COLUMNS)});
    auto losses = array<double>({starts.shape(0)});
    std::vector<Outcome> outcomes;
    {
      nb::gil_scoped_release release;
      outcomes = fit_starts(copy(starts), copy(first), copy(last), flags(free), flags(tied),
                            samples_of(points, distance, weight, background), stages_of(stages), {overlap, blending},
                            limits_of(limits), threads);
    }
    for (size_t i = 0; i < outcomes.size(); ++i) {
      std::copy(outcomes[i].rows.begin(), outcomes[i].rows.end(), out.data() + i * COLUMNS);
      losses.data()[i] = outcomes[i].loss;
    }
    return nb::make_tuple(out, losses);
  }, "starts"_a, "first"_a, "last"_a, "free"_a, "tied"_a, "points"_a, "distance"_a,
     "weight"_a, "background"_a, "stages"_a, "overlap"_a, "blending"_a, "limits"_a, "threads"_a,
     "Rows and losses of one single-part fit per start, each on its range first:last of the samples.");

  m.def("removal_counts", [](In<float> rows, In<float> points, In<uint8_t> inside, In<float> weight, int threads) {
    auto out = array<double>({rows.shape(0) + 1, 2});
    const auto parts = parts_of(rows);
    nb::gil_scoped_release release;
    removal_counts(parts, points.data(), inside.data(), weight.data(), int64_t(points.shape(0)), out.data(), threads);
    return out;
  }, "rows"_a, "points"_a, "inside"_a, "weight"_a, "threads"_a,
     "Weighted intersection and union (M + 1, 2) without each part in turn, and of all.");

  m.def("decompose", [](In<float> field, float spacing, int regions, double fraction, double least_depth, double least_voxels) {
    const Grid grid{int(field.shape(0)), int(field.shape(1)), int(field.shape(2)), spacing};
    auto labels = array<int32_t>({field.shape(0), field.shape(1), field.shape(2)});
    std::vector<float> depths;
    {
      nb::gil_scoped_release release;
      depths = decompose(copy(field), grid, {regions, fraction, least_depth, least_voxels}, labels.data());
    }
    return nb::make_tuple(labels, depths);
  }, "field"_a, "spacing"_a, "regions"_a, "fraction"_a, "least_depth"_a,
     "least_voxels"_a,
     "Each voxel's region, thickest first, and the regions' erosion depths.");

  m.def("profile_distances", [](In<double> corners, In<int64_t> starts, In<uint8_t> counts, In<double> points, int threads) {
    auto out = array<double>({points.shape(0)});
    const Outline outline = outline_of(corners.data(), copy(starts), counts.data());
    nb::gil_scoped_release release;
    profile_distances(outline, points.data(), int64_t(points.shape(0)), out.data(), threads);
    return out;
  }, "corners"_a, "starts"_a, "counts"_a, "points"_a, "threads"_a,
     "Signed distances (N,) in the plane to loops of lines and arcs.");

  m.def("profile_gradients", [](In<double> corners, In<int64_t> starts, In<uint8_t> counts, In<double> points,
                                In<double> upstream, int threads) {
    auto out = array<double>({corners.shape(0), size_t(3)});
    auto by_point = array<double>({points.shape(0), size_t(2)});
    const Outline outline = outline_of(corners.data(), copy(starts), counts.data());
    {
      nb::gil_scoped_release release;
      profile_gradients(outline, points.data(), upstream.data(), int64_t(points.shape(0)), int64_t(corners.shape(0)),
                        out.data(), by_point.data(), threads);
    }
    return nb::make_tuple(out, by_point);
  }, "corners"_a, "starts"_a, "counts"_a, "points"_a, "upstream"_a, "threads"_a,
     "Derivatives (V, 3) of sum(upstream * distance) by the corners, and (N, 2) of each distance by its point.");

  m.def("convex_hull", [](In<double> points, bool plain) {
    Hull hull;
    {
      nb::gil_scoped_release release;
      hull = convex_hull(points.data(), int64_t(points.shape(0)), plain);
    }
    auto faces = array<int64_t>({hull.faces.size(), 3});
    for (size_t i = 0; i < hull.faces.size(); ++i) std::copy_n(hull.faces[i].begin(), 3, faces.data() + 3 * i);
    return nb::make_tuple(faces, hull.volume);
  }, "points"_a, "plain"_a,
     "Faces (F, 3) of the hull of points (N, 3), and its volume.");

  m.def("split_hull_volumes", [](In<double> vertices, In<int64_t> faces, In<int64_t> edges, In<double> planes, double slack) {
    auto out = array<double>({planes.shape(0)});
    nb::gil_scoped_release release;
    split_hull_volumes(mesh_of(vertices, faces, edges), planes.data(), int64_t(planes.shape(0)), slack, out.data());
    return out;
  }, "vertices"_a, "faces"_a, "edges"_a, "planes"_a, "slack"_a,
     "Volume (P,) of the hulls of a mesh's two sides of each plane.");

  m.def("volumes_beyond", [](In<double> vertices, In<int64_t> faces, In<double> areas, In<double> normal, In<double> offsets) {
    auto out = array<double>({offsets.shape(0)});
    nb::gil_scoped_release release;
    volumes_beyond(vertices.data(), int64_t(vertices.shape(0)), faces.data(), areas.data(), int64_t(faces.shape(0)),
                   normal.data(), offsets.data(), int64_t(offsets.shape(0)), out.data());
    return out;
  }, "vertices"_a, "faces"_a, "areas"_a, "normal"_a, "offsets"_a,
     "Volume (K,) of a solid beyond each of parallel planes.");

  m.def("circle_through", [](In<double> points) {
    const Circle circle = circle_through(points.data(), int64_t(points.shape(0)));
    return nb::make_tuple(circle.x, circle.y, circle.radius, circle.off);
  }, "points"_a, "Centre and radius of the circle nearest to points (K, 2), and the largest distance of any from it.");

  m.def("open_line", [](In<double> points, double tolerance) {
    const std::vector<int64_t> kept = open_line(points.data(), int64_t(points.shape(0)), tolerance);
    auto out = array<int64_t>({kept.size()});
    std::copy(kept.begin(), kept.end(), out.data());
    return out;
  }, "points"_a, "tolerance"_a, "Indices of the corners of an open chain (K, 2) that lines within the tolerance need.");

  m.def("read_grid", [](In<float> values, In<double> origin, double spacing, In<double> points) {
    auto out = array<double>({points.shape(0)});
    const std::array<int64_t, 3> counts{int64_t(values.shape(0)), int64_t(values.shape(1)), int64_t(values.shape(2))};
    nb::gil_scoped_release release;
    read_grid(values.data(), counts, origin.data(), spacing, points.data(), int64_t(points.shape(0)), out.data());
    return out;
  }, "values"_a, "origin"_a, "spacing"_a, "points"_a,
     "Distance (N,) at points (N, 3), interpolated in a grid (X, Y, Z); beyond it that of its nearest place, and the way there.");

  m.def("connected", [](In<int64_t> groups, int64_t nodes) {
    auto component = array<int64_t>({size_t(nodes)});
    nb::gil_scoped_release release;
    connected(groups.data(), int64_t(groups.shape(0)), int64_t(groups.shape(1)), nodes, component.data());
    return component;
  }, "groups"_a, "nodes"_a, "Which component (N,) each node is of, where groups (G, K) hang together; by their first nodes.");

  nb::class_<TriangleTree>(m, "TriangleTree", "Triangles in a tree of boxes.")
      .def("__init__", [](TriangleTree* self, In<double> vertices, In<int64_t> faces) {
        nb::gil_scoped_release release;
        new (self) TriangleTree(vertices.data(), faces.data(), int64_t(faces.shape(0)));
      }, "vertices"_a, "faces"_a)
      .def("squared_distances", [](const TriangleTree& self, In<double> points, int threads) {
        auto out = array<double>({points.shape(0)});
        nb::gil_scoped_release release;
        self.squared_distances(points.data(), int64_t(points.shape(0)), out.data(), threads);
        return out;
      }, "points"_a, "threads"_a, "Squared distances (N,) of points (N, 3) to the nearest triangle.")
      .def("windings", [](const TriangleTree& self, In<double> points, int threads) {
        auto out = array<int32_t>({points.shape(0)});
        nb::gil_scoped_release release;
        self.windings(points.data(), int64_t(points.shape(0)), out.data(), threads);
        return out;
      }, "points"_a, "threads"_a, "How often (N,) triangles without open edges wind around points (N, 3).");

  m.def("networks_distances", [](In<float> local, std::vector<In<float>> weights, std::vector<In<float>> shifts, In<float> scale,
                                 In<float> room, In<float> unit, float reach, int octaves, int threads) {
    auto out = array<float>({local.shape(0), local.shape(1)});
    const Networks networks = networks_of(weights, shifts);
    const Rooms rooms{scale.data(), room.data(), unit.data(), reach, octaves, false};
    nb::gil_scoped_release release;
    distances(networks, rooms, local.data(), int64_t(local.shape(1)), out.data(), threads);
    return out;
  }, "local"_a, "weights"_a, "shifts"_a, "scale"_a, "room"_a, "unit"_a, "reach"_a, "octaves"_a, "threads"_a,
     "Distances (G, N) at local points (G, N, 3) of parts (G, 3): of their networks near their rooms, else of these.");

  m.def("networks_gradients", [](In<float> local, std::vector<In<float>> weights, std::vector<In<float>> shifts, In<float> scale,
                                 In<float> room, In<float> unit, float reach, int octaves, In<float> upstream, int threads,
                                 bool learning) {
    auto by_local = array<float>({local.shape(0), local.shape(1), 3}), by_scale = array<float>({local.shape(0), 3});
    std::vector<Out<float>> by_weight, by_shift;
    std::vector<float*> weight_places, shift_places;
    for (size_t l = 0; l < weights.size(); ++l) {
      by_weight.push_back(array<float>({weights[l].shape(0), weights[l].shape(1), weights[l].shape(2)}));
      by_shift.push_back(array<float>({shifts[l].shape(0), shifts[l].shape(1)}));
      weight_places.push_back(by_weight.back().data());
      shift_places.push_back(by_shift.back().data());
    }
    {
      const Networks networks = networks_of(weights, shifts);
      const Rooms rooms{scale.data(), room.data(), unit.data(), reach, octaves, learning};
      nb::gil_scoped_release release;
      distance_gradients(networks, rooms, local.data(), int64_t(local.shape(1)), upstream.data(), by_local.data(),
                         by_scale.data(), weight_places, shift_places, threads);
    }
    return nb::make_tuple(by_local, by_scale, by_weight, by_shift);
  }, "local"_a, "weights"_a, "shifts"_a, "scale"_a, "room"_a, "unit"_a, "reach"_a, "octaves"_a, "upstream"_a, "threads"_a,
     "learning"_a,
     "Derivatives of sum(upstream * distances) by local points, half-lengths, and each layer's weights and shifts. Where "
     "`learning`, networks that say less than the room also hear where more is wanted.");
}
