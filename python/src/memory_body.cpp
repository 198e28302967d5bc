#include "memory_body.h"

#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <filesystem>
#include <optional>
#include <string_view>
#include <tuple>
#include <utility>

#include "errors.h"
#include "interrupts.h"
#include "kerf/mesh/whole_file.h"
#include "kerf/scene/body_scene.h"
#include "python_lock.h"

namespace nb = nanobind;
using namespace nb::literals;

namespace kerf::python {
namespace {

const char* word_of(Thinness thinness) {
  switch (thinness) {
    case Thinness::kThin: return "thin";
    case Thinness::kDoubtful: return "doubtful";
    case Thinness::kNotThin: return "not thin";
  }
  return "";
}

std::tuple<double, double, double> tuple_of(Vec3 p) { return {p.x, p.y, p.z}; }

nb::dict quality_of(const Midsurface& made) {
  const MidsurfaceQuality& q = made.quality;
  nb::dict out;
  out["need"] = q.need;
  out["smallest_angle"] = q.smallest_angle;
  out["mean_smallest_angle"] = q.mean_smallest_angle;
  out["medial_mean"] = q.medial_mean;
  out["medial_max"] = q.medial_max;
  out["thickness_mean"] = q.thickness_mean;
  out["thickness_max"] = q.thickness_max;
  out["good_rays"] = q.good_rays;
  out["to_prisms_mean"] = q.to_prisms_mean;
  out["to_prisms_max"] = q.to_prisms_max;
  out["to_visual_max"] = q.to_visual_max;
  out["spanning_edges"] = q.spanning_edges;
  out["mean_half_thickness"] = q.mean_half_thickness;
  out["crossings"] = q.crossings;
  return out;
}

nb::dict mesh_of(TriangleMesh mesh) {
  const std::size_t vertices = mesh.positions.size(), triangles = mesh.triangles.size();
  nb::dict out;
  out["vertices"] = read_only_array<double>(std::move(mesh.positions.raw()), {vertices, 3});
  out["triangles"] = read_only_array<std::int32_t>(std::move(mesh.triangles.raw()), {triangles, 3});
  return out;
}

/// As `kerf bind --diagnose` saves it.
nb::dict surface_of(MidsurfaceDiagnosis diagnosis) {
  nb::dict out = mesh_of(std::move(diagnosis.surface));
  for (auto [name, values] : {std::pair{"side", &diagnosis.side},
                              {"confidence", &diagnosis.confidence},
                              {"thickness", &diagnosis.thickness}}) {
    const std::size_t count = values->size();
    out[name] = read_only_array<float>(std::move(*values), {count});
  }
  const std::size_t flags = diagnosis.flag.size();
  out["flag"] = read_only_array<std::uint8_t>(std::move(diagnosis.flag), {flags});
  return out;
}

void write_judgement(Midsurface made, nb::dict& out) {
  const MidsurfaceVerdict& v = made.verdict;
  out["thinness"] = word_of(v.thinness);
  out["reasons"] = v.reasons;
  out["warnings"] = v.warnings;
  out["notes"] = made.notes;
  nb::list places;
  for (const MidsurfacePlace& place : v.places) {
    nb::dict entry;
    entry["point"] = tuple_of(place.point);
    entry["what"] = place.what;
    places.append(entry);
  }
  out["places"] = places;
  out["width_over_thickness"] = v.width_over_thickness;
  out["narrow_share"] = v.narrow_share;
  out["narrowest"] = tuple_of(v.narrowest);
  out["volume_ratio"] = v.volume_ratio;
  out["branch_length"] = v.branch_length;
  out["one_sided"] = v.one_sided;
  out["quality"] = quality_of(made);
  out["collision"] = mesh_of(std::move(made.collision));
  out["surface"] = surface_of(std::move(made.diagnosis));
}

template <class Item>
nb::object positions_of(const std::vector<Item>& items) {
  return read_only_array<double>(std::vector<Item>(items), {items.size(), 3});
}
template <class Id>
nb::object corners_of(const std::vector<Id>& corners) {
  return read_only_array<std::int32_t>(std::vector<Id>(corners), {corners.size() / 3, 3});
}

}  // namespace

MemoryBody MemoryBody::bind(BodyRequest request) {
  MemoryBody out;
  const SceneBody& body = request.body;
  if (!body.model.empty()) out.title_ = body.model;
  if (!request.given.visual && !body.visual.empty()) {
    out.sources_.push_back({"the visual mesh", body.visual});
    out.title_ = std::filesystem::path(body.visual).stem().string();
  }
  if (!request.given.collision && !body.collision.empty())
    out.sources_.push_back({"the collision mesh", body.collision});
  Interrupts interrupts;
  std::optional<Midsurface> made;
  std::optional<Error> error;
  {
    const WithoutPythonLock release;
    const Status sound = check_nature(request.nature, "bind");
    auto loaded = sound ? load_scene_body(body, interrupts.listener(), &made, std::move(request.given))
                        : Result<SceneBodyLoaded>(sound.error());
    if (!loaded) {
      error = loaded.error();
    } else {
      out.nature_ = nature_to_keep(body, *loaded, request.nature);
      std::vector<std::string> notes = std::move(loaded->notes);
      SceneBodyLoaded kept = with_nature(std::move(loaded->bound), out.nature_);
      kept.notes = std::move(notes);
      out.loaded_ = std::make_shared<const SceneBodyLoaded>(std::move(kept));
    }
  }
  interrupts.raise();
  if (made) {
    write_judgement(std::move(*made), request.judgement);
    out.diagnosis_ = request.judgement;
    out.diagnosis_ = out.diagnosis();
  }
  if (error) throw Failure(*error);
  return out;
}

nb::object MemoryBody::diagnosis() const {
  if (!nb::isinstance<nb::dict>(diagnosis_)) return diagnosis_;
  // What is asked for belongs to who asked; arrays are read-only.
  nb::dict out;
  for (const auto& [word, value] : nb::cast<nb::dict>(diagnosis_))
    out[word] = nb::isinstance<nb::dict>(value)   ? nb::steal(PyDict_Copy(value.ptr()))
                : nb::isinstance<nb::list>(value) ? nb::steal(PySequence_List(value.ptr()))
                                                  : nb::borrow(value);
  return out;
}

MemoryBody MemoryBody::load(const std::string& file) {
  MemoryBody out;
  out.title_ = std::filesystem::path(file).stem().string();
  out.sources_.push_back({"the body", file});
  std::optional<Error> error;
  {
    const WithoutPythonLock release;
    auto bound = load_bound_body(file, &out.nature_);
    if (!bound) error = bound.error();
    else out.loaded_ = std::make_shared<const SceneBodyLoaded>(with_nature(std::move(*bound), out.nature_));
  }
  if (error) throw Failure(*error);
  return out;
}

MemoryBody MemoryBody::of_bytes(nb::bytes bytes, std::string title) {
  MemoryBody out;
  out.title_ = std::move(title);
  const std::string_view view(bytes.c_str(), bytes.size());  // the caller's, who waits
  std::optional<Error> error;
  {
    const WithoutPythonLock release;
    auto bound = parse_bound_body(view, "a pickled body", &out.nature_);
    if (!bound) error = bound.error();
    else out.loaded_ = std::make_shared<const SceneBodyLoaded>(with_nature(std::move(*bound), out.nature_));
  }
  if (error) throw Failure(*error);
  return out;
}

nb::bytes MemoryBody::bytes() const {
  std::string out;
  {
    const WithoutPythonLock release;
    out = bound_body_bytes(loaded_->bound, nature_);
  }
  return nb::bytes(out.data(), out.size());
}

void MemoryBody::save(const std::string& file) const {
  for (const Source& source : sources_)
    if (same_file(source.file, file))
      throw Failure(bad_input("the body " + file + " would replace " + source.what + " " + source.file +
                              ": they are the same file; choose another place for what is written"));
  Status saved;
  {
    const WithoutPythonLock release;
    saved = save_bound_body(loaded_->bound, file, nature_);
  }
  check(saved);
}

std::string MemoryBody::scene_text(const std::string& name) const {
  return body_scene_text(title_, name, loaded_->bound.complex);
}

nb::object MemoryBody::vertices() {
  return vertices_.get(0, [&] { return positions_of(loaded_->bound.complex.visual.rest.raw()); });
}
nb::object MemoryBody::triangles() {
  return triangles_.get(0, [&] { return corners_of(loaded_->bound.complex.visual.origin.raw()); });
}
nb::object MemoryBody::collision_vertices() {
  return collision_vertices_.get(0, [&] { return positions_of(loaded_->bound.complex.collision.rest.raw()); });
}
nb::object MemoryBody::collision_triangles() {
  return collision_triangles_.get(0, [&] { return corners_of(loaded_->bound.complex.collision.origin.raw()); });
}

}  // namespace kerf::python
