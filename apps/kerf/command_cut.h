// kerf cut BODY --from X,Y,Z --to X,Y,Z --out DIR
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "kerf/base/vec.h"

namespace kerf::app {

struct CutOptions {
  std::string body;                 ///< a file saved by kerf bind, a visual mesh, or the name of a model
  std::filesystem::path collision;  ///< with a visual mesh: its mid-surface
  std::optional<double> thickness;  ///< metres, for an open visual mesh
  std::optional<double> weld;       ///< metres; corners this close are one; 0: none
  double scale = 1;                 ///< metres per unit of the mesh files
  bool through = false;             ///< every layer, not only the first that the blade meets
  Vec3 from, to;                    ///< metres, at rest: where the middle of the blade starts and ends
  std::optional<Vec3> along;        ///< direction of the blade's edge; default: across the body, along its normal
  std::filesystem::path out;        ///< folder for the results
};

/// Cuts the body once, at rest, and writes report.json, visual.obj and collision.obj. Returns the exit
/// status.
int cut_body(const CutOptions& options);

}  // namespace kerf::app
