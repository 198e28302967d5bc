#include <nanobind/ndarray.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <array>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "arrays.h"
#include "batch.h"
#include "define.h"

namespace nb = nanobind;
using namespace nb::literals;

namespace kerf::python {
namespace {

/// For Python's collector: a session may hold the batch that it is in.
int traverse_batch(PyObject* self, visitproc visit, void* arg) {
  Py_VISIT(Py_TYPE(self));
  if (nb::inst_ready(self))
    for (const nb::object& session : nb::inst_ptr<Batch>(self)->sessions()) Py_VISIT(session.ptr());
  return 0;
}
int clear_batch(PyObject* self) {
  if (nb::inst_ready(self)) nb::inst_ptr<Batch>(self)->forget();
  return 0;
}
PyType_Slot batch_slots[] = {{Py_tp_traverse, reinterpret_cast<void*>(&traverse_batch)},
                             {Py_tp_clear, reinterpret_cast<void*>(&clear_batch)},
                             {0, nullptr}};

std::int64_t as_number(std::size_t count) { return static_cast<std::int64_t>(count); }

/// Rows for each session. The shapes are looked at in kerf/_batch.py.
using Numbers = nb::ndarray<const double, nb::c_contig, nb::device::cpu>;
using NumbersOut = nb::ndarray<double, nb::c_contig, nb::device::cpu>;
using Flags = nb::ndarray<const bool, nb::c_contig, nb::device::cpu>;
using NamedNumbers = std::vector<std::pair<std::string, Numbers>>;

const double* numbers_or_none(const nb::object& array, std::size_t wanted) {
  if (array.is_none()) return nullptr;
  const auto numbers = nb::cast<Numbers>(array);
  if (numbers.size() != wanted) throw nb::value_error("an array has the wrong size");
  return numbers.data();
}
const std::uint8_t* flags_or_none(const nb::object& array, std::size_t wanted) {
  if (array.is_none()) return nullptr;
  const auto flags = nb::cast<Flags>(array);
  if (flags.size() != wanted) throw nb::value_error("an array has the wrong size");
  return reinterpret_cast<const std::uint8_t*>(flags.data());
}

}  // namespace

void define_batches(nb::module_& m) {
  nb::class_<Batch>(m, "Batch", nb::type_slots(batch_slots))
      .def(nb::init<std::vector<nb::object>, int>(), "sessions"_a, "threads"_a)
      .def("__len__", &Batch::size)
      .def_prop_ro("threads", &Batch::threads, "Threads that take the turns, the caller's included.")
      .def(
          "_turn",
          [](Batch& self, std::int64_t steps, const nb::object& edges, const nb::object& cuts, const nb::object& takes,
             const NamedNumbers& grasps, const NamedNumbers& tools) {
            BatchTurn turn;
            turn.steps = steps;
            turn.edges = numbers_or_none(edges, 6 * self.size());
            turn.cuts = flags_or_none(cuts, self.size());
            turn.takes = flags_or_none(takes, self.size());
            for (const auto& [id, targets] : grasps) {
              if (targets.size() != 3 * self.size()) throw nb::value_error("an array has the wrong size");
              turn.grasps.emplace_back(id, targets.data());
            }
            for (const auto& [id, poses] : tools) {
              if (poses.size() != 6 * self.size()) throw nb::value_error("an array has the wrong size");
              turn.tools.emplace_back(id, poses.data());
            }
            return self.turn(turn);
          },
          "steps"_a, "edges"_a.none(), "cuts"_a.none(), "takes"_a.none(), "grasps"_a, "tools"_a)
      .def(
          "_place_blade",
          [](Batch& self, std::size_t session, nb::handle base, nb::handle tip) {
            self.place_blade(session, place_of(base, "base"), place_of(tip, "tip"));
          },
          "session"_a, "base"_a, "tip"_a)
      .def(
          "_to_world",
          [](Batch& self, const Numbers& rest, const NumbersOut& now) {
            if (rest.size() != now.size() || self.size() == 0 || rest.size() % (3 * self.size()) != 0)
              throw nb::value_error("an array has the wrong size");
            self.places_now(rest.data(), rest.size() / (3 * self.size()), now.data());
          },
          "rest"_a, "now"_a)
      .def(
          "_to_rest",
          [](Batch& self, const Numbers& now, const NumbersOut& rest, const NumbersOut& distance) {
            if (rest.size() != now.size() || 3 * distance.size() != now.size() || self.size() == 0 ||
                rest.size() % (3 * self.size()) != 0)
              throw nb::value_error("an array has the wrong size");
            self.places_at_rest(now.data(), now.size() / (3 * self.size()), rest.data(), distance.data());
          },
          "now"_a, "rest"_a, "distance"_a)
      .def(
          "_counts",
          [](Batch& self) {
            const std::vector<BodyCounts> counts = self.counts();
            std::vector<std::array<std::int64_t, 7>> rows;
            for (const BodyCounts& c : counts)
              rows.push_back({as_number(c.visual_vertices), as_number(c.visual_triangles),
                              as_number(c.collision_vertices), as_number(c.collision_triangles), as_number(c.nodes),
                              as_number(c.hexahedra), c.pieces});
            return own_array<std::int64_t>(std::move(rows), {counts.size(), std::size_t{7}});
          },
          nb::sig("def _counts(self) -> numpy.typing.NDArray[numpy.int64]"))
      .def(
          "_piece_masses",
          [](Batch& self, std::size_t most) {
            return own_array<double>(self.piece_masses(most), {self.size(), most});
          },
          "most"_a, nb::sig("def _piece_masses(self, most: int) -> numpy.typing.NDArray[numpy.float64]"))
      .def(
          "_tool",
          [](Batch& self, const std::string& id) {
            return own_array<std::uint8_t>(self.tools(id), {self.size(), sizeof(ToolRecord)});
          },
          "id"_a, nb::sig("def _tool(self, id: str) -> numpy.typing.NDArray[numpy.uint8]"))
      .def(
          "_grasp",
          [](Batch& self, const std::string& id) {
            return own_array<std::uint8_t>(self.grasps(id), {self.size(), sizeof(GraspRecord)});
          },
          "id"_a, nb::sig("def _grasp(self, id: str) -> numpy.typing.NDArray[numpy.uint8]"));
}

}  // namespace kerf::python
