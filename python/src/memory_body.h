// A bound body as Python sees it: made of arrays or files, handed to sessions, saved. It never changes.
#pragma once

#include <nanobind/nanobind.h>

#include <memory>
#include <string>
#include <vector>

#include "arrays.h"
#include "kerf/scene/scene_body.h"

namespace kerf::python {

/// What a body is made from, and how.
struct BodyRequest {
  SceneBody body;          ///< its file names stand for surfaces that are given
  SurfacesInMemory given;  ///< instead of the files
  BodyNature nature;       ///< what a person says of its material
  nanobind::dict
      judgement;  ///< filled in with the diagnosis of the collision mesh that is made, also where the body is refused
};

class MemoryBody {
 public:
  /// Without Python's lock; Ctrl-C ends it.
  static MemoryBody bind(BodyRequest request);
  /// One that was saved.
  static MemoryBody load(const std::string& file);

  /// One whose bytes() these are, with its title.
  static MemoryBody of_bytes(nanobind::bytes bytes, std::string title);

  /// What save() writes.
  [[nodiscard]] nanobind::bytes bytes() const;
  [[nodiscard]] const std::string& title() const { return title_; }
  /// Bad input: the file is one that it was made from.
  void save(const std::string& file) const;
  [[nodiscard]] const std::shared_ptr<const SceneBodyLoaded>& loaded() const { return loaded_; }
  /// The scene of kerf.Session(body), in which this name stands for it.
  [[nodiscard]] std::string scene_text(const std::string& name) const;
  [[nodiscard]] bool closed() const { return loaded_->bound.complex.closed; }
  [[nodiscard]] const std::vector<std::string>& notes() const { return loaded_->notes; }
  /// A dict; None where no collision mesh was made.
  [[nodiscard]] nanobind::object diagnosis() const;

  nanobind::object vertices();
  nanobind::object triangles();
  nanobind::object collision_vertices();
  nanobind::object collision_triangles();

 private:
  struct Source {
    std::string what, file;
  };
  std::string title_ = "body";
  std::shared_ptr<const SceneBodyLoaded> loaded_;
  BodyNature nature_;
  std::vector<Source> sources_;
  nanobind::object diagnosis_ = nanobind::none();
  KeptArray vertices_, triangles_, collision_vertices_, collision_triangles_;
};

}  // namespace kerf::python
