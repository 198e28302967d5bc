// A session in a file, or in memory for another process: the scene with its meshes, and the state (Session::state_bytes).
//
// Layout, little-endian: 8 bytes "KERFSTAT", version (u32), 0 (u32), a 64-bit hash of all that follows; then a recording in which nothing is done, which has the scene,
// and the state, each as its length (u64) and its bytes.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "kerf/base/progress.h"
#include "kerf/base/result.h"
#include "kerf/record/recording.h"
#include "kerf/session/session.h"

namespace kerf {

/// Of the layout, and of everything that a state has in it: a kerf whose structs are others reads no older states.
inline constexpr std::uint32_t kSavedSessionVersion = 1;

struct SavedSession {
  Recording scene;  ///< where it comes from, and the instruction set; nothing is done in it
  std::string state;
};

/// Bad input: as Session::state_bytes. `scene`: a recording of the session; only what it begins with is kept. Its meshes have been taken (take_meshes).
Result<std::string> saved_session_bytes(const Session& session, const Recording& scene);
/// The same around Session::state_bytes.
std::string saved_state_bytes(const std::string& state, const Recording& scene);
/// Bad input, naming the file: not a state, cut off, damaged (hash), of another version or another instruction set.
Result<SavedSession> parse_saved_session(std::string_view bytes, const std::string& name);
/// The state in a file. Bad input too: a file that can't be read, or is too large.
Result<SavedSession> read_saved_session(const std::string& path);
/// A session that goes on from there, to the bit. Bad input as session_of and Session::take_state.
Result<Session> go_on(const SavedSession& saved, const Progress& progress = {},
                      const std::vector<std::filesystem::path>& mesh_folders = {}, const std::string& file = {});

}  // namespace kerf
