// The documentation of scene files, made from the tables that the reader uses.
#pragma once

#include <string>
#include <vector>

namespace kerf {

struct SceneKeyDoc {
  std::string table;  ///< "[material]", "[[command]] type = \"blade\"", "" for the top level
  std::string key;
  std::string type;           ///< "number", "3 numbers", "word: a, b, c" ...
  std::string unit;           ///< "" for none
  std::string range;          ///< "> 0", "" for any
  std::string default_value;  ///< "required", "-" when absent means something of its own, or TOML
  std::string doc;
};

/// Every key of every table, in the order of the documentation.
std::vector<SceneKeyDoc> scene_schema();

/// The whole documentation as plain text, lines of at most 100 columns.
std::string scene_schema_text();

/// The same as Markdown (docs/scene.md).
std::string scene_schema_markdown();

}  // namespace kerf
