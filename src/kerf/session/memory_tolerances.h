// What hexahedra and models take of memory, measured (lattice_memory.h).
//
// Peak of `kerf run` without the program's own 28 MB, in bytes for each hexahedron: one step, nothing fixed, adaptive and direct.
//
//   body          cells            hexahedra   adaptive   direct
//   steak         15 x 10 x 8          1,094          -   27,000
//   closed-sheet  60 x 60 x 1          3,600      4,600   32,000
//   strip         40 x 10 x 10         4,000          -   37,000
//   steak         30 x 20 x 8          4,220          -   43,000
//   closed-sheet  60 x 60 x 4         14,400      4,400   45,000
//   closed-sheet  120 x 120 x 1       14,400      4,900   35,000
//   closed-sheet  200 x 200 x 1       40,000          -   37,000
//   strip         80 x 20 x 20        32,000      4,100        -
//   steak         120 x 80 x 16      126,230      3,900        -
//   closed-sheet  400 x 400 x 1      160,000      3,950        -
//   strip         200 x 200 x 50   2,000,000      2,800        -
#pragma once

namespace kerf {

/// Bytes for each hexahedron: its arrays, nodes and weights, the matrices of mechanics, embeddings, an iterative solver, and
/// the state that a page's reset goes back to (800). At half, sheets of one layer pass that need twice the limit; at double, bodies are refused that fit.
inline constexpr double kBytesPerHexahedron = 6000;

/// Bytes for each cell of the box, with material or without: 4, 8 and 16 million cells around 800 hexahedra took 89 each. At half, a box that is
/// nearly empty takes twice what was said; at double, it is refused without need.
inline constexpr double kBytesPerCell = 90;

/// A sparse factorisation takes, for each of n hexahedra, the smaller one of two: by nested dissection of a sheet of m layers and n / m columns
/// kSheetFactorBytes (m + 1)^2 / m log2(sqrt(n / m)), and of a thick body kThickFactorBytes n^(1/3). That is 0 to 20 % above each measured one.
/// At half, bodies pass that need twice what was said; at double, bodies are refused that fit.
inline constexpr double kSheetFactorBytes = 1350, kThickFactorBytes = 2700;

/// Bytes for each visual triangle of a model: its mesh, what it binds to, and the surface of the session. Peaks of `kerf run` on
/// closed-sheet were 349 at 100,000 and 355 at 500,000, without a step. At half, models pass that need nearly twice what was said; at double, models are
/// refused that fit.
inline constexpr double kBytesPerModelTriangle = 400;

}  // namespace kerf
