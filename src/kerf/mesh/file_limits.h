// How large files may be that are read: what is larger is named for what it is not, or would not fit into the memory of its kind of machine.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "kerf/base/result.h"

namespace kerf {

/// A kind of file, for reading.
struct FileKind {
  const char* what;       ///< with its article
  std::uint64_t most;     ///< bytes; more than some platforms can address
  const char* otherwise;  ///< the way out where a file is larger
  /// Looks at the first bytes (kFirstBytes, or all of a smaller file) before the rest is read; null: nothing is known of them.
  Status (*look)(std::string_view first, const std::string& path) = nullptr;
};

/// So many bytes are read before a file is looked at. Headers have 20; a text's first word stands behind no longer comment.
inline constexpr std::size_t kFirstBytes = 4096;

/// OBJ, PLY, STL and OFF: 50 million triangles as OBJ, ten times the largest that was bound. At half, such scans in ASCII are refused; at
/// double, a mistaken file is read for half a minute and takes 30 GB as a mesh.
inline constexpr std::uint64_t kMostMeshBytes = std::uint64_t{4} << 30;
/// A bound body has 200 to 300 bytes for each visual triangle: what a mesh of the largest size binds to. At half, it could not be loaded.
inline constexpr std::uint64_t kMostBodyBytes = std::uint64_t{16} << 30;
/// A scene is text that people write: 16 MiB are 200,000 poses. At half, some tracked motions don't fit; at double, the parser takes 1 GB.
inline constexpr std::uint64_t kMostSceneBytes = std::uint64_t{16} << 20;
/// Recordings hold up to 86 MiB of meshes and 100 bytes a change: ten million changes. At half, a day at 100 Hz does not fit; at double,
/// the parser takes 20 GB.
inline constexpr std::uint64_t kMostRecordingBytes = std::uint64_t{1} << 30;
/// A saved state has the bound body, cut, and its motion: that of the cut steak has 180 bytes for each visual triangle. At half, bodies that may be loaded could not be
/// saved and read again; at double, what is read is larger than any of them.
inline constexpr std::uint64_t kMostStateBytes = std::uint64_t{16} << 30;
/// What the program itself wrote and reads again, and the files of a page. Reports of a billion steps are not read.
inline constexpr std::uint64_t kMostOtherBytes = std::uint64_t{1} << 30;

inline constexpr FileKind kMeshFile{"a mesh", kMostMeshBytes, "give a coarser mesh"};
inline constexpr FileKind kSceneFile{"a scene", kMostSceneBytes, "meshes and bodies stand in files of their own"};
inline constexpr FileKind kNamedFile{"a file of a scene", kMostBodyBytes, "give a smaller one"};
inline constexpr FileKind kOtherFile{"such a file", kMostOtherBytes, "give a smaller one"};

}  // namespace kerf
