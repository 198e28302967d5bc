// Numbers that decide in a solve, for pieces in flight (step.cpp) and passes over contacts (pass_length.h), and what speeds it may end with (speed_cap.h). Of taut cells
// (element_pass.h), of what holds a piece (rigid_pieces.h), and of the order of sums. Of those in flight, each: its unit, where it comes from, and what half and double of it do to 180 runs of spinning slabs, strips
// and plates (0.03 to 100 MPa, 5 to 60 rad/s, steps of 5 and 16.7 ms, half of them bent at the start): one gains 8 % of its kinetic energy, in 25.6 iterations a step.
#pragma once

#include <cstddef>

namespace kerf {

/// rad: a piece that turns by more in a step is held to kFlightTolerance. A step stretches it by half the square of that, and what a solve leaves undone of less stretch is
/// little. Held to it at any spin, a disc that falls and lands (scene punch) takes 82 iterations for 76. Half: 25.6, double: 25.2, and
/// again one run gains 8 %.
inline constexpr double kFlightTurn = 0.25;

/// Tolerances of a solve, of the momentum that the nodes of a piece have about its centre: what the residual may hold of it, ten times it at the default tolerance. Without it
/// a strip of 10 MPa at a radian a step comes to 1.07 of its kinetic energy; a hundredth of it takes 35 iterations a step for 28, and is no better. Half: 25.9, double: 25.3, again
/// one run gains 8 %. Without it, a second one gains more than 1 %.
inline constexpr double kFlightTolerance = 1000;

/// rad: a piece that is held or touched and turns by more in a step is held to kTurnTolerance. A strip of 100 x 20 x 5 mm held at an edge swings for 2 s (0.5 and 5 MPa; 5, 10
/// and 16.7 ms): this takes 11.3 to 24.8 iterations a step for 10.0 to 11.3, half 0 to 8 % more, double 6 to 26 % fewer; then 5 MPa gains 1.3 % of its fall at 5 ms.
inline constexpr double kTurn = 0.05;

/// Tolerances of a solve, of the momentum that the nodes of such a piece bring along: what the residual may hold of it. Without it the strip of 5 MPa gains 14 and 30 % of its fall
/// (10, 16.7 ms); with this the third swing is that of a rod to 2 degrees. Half: 4 to 11 % more iterations, double: 7 to 10 % fewer, both alike to a degree. Ten times: 8 degrees off.
inline constexpr double kTurnTolerance = 10;

/// Shares of a tension that the matrix leaves out. A cell under tension resists turning; while rotations are frozen in a step, that is on the right-hand side
/// alone. Transverse waves for which dt^2 (tension - bending) is over 4 times the mass then go up in one step and down in the next. They never do below a
/// tension of density h^2 / dt^2, nor of 1.15 t sqrt(E density) / dt where t is the thickness. Half or double: taut strips come to rest and
/// hanging ones swing alike (`Taut`, `Motion`). A tenth of both: after 2 s a hanging strip is over 12 degrees off.
inline constexpr double kTautness = 0.25, kTautBending = 0.3;

/// Of a tension: what a step makes itself by turning the cell is left out where it is more than this. In what hardly turns it is less, and bits stay. In what
/// turns about a support it is nearly all. Half or double, or 50 times it: the hanging strips of `Motion` swing alike. At one nothing is left
/// out, and they turn as in syrup.
inline constexpr double kMadeByTurning = 0.01;

/// rad^2: a cell that turns by more than the root of it in a step counts as turned by that much. At a radian what it makes has no end. Sessions divide
/// steps at 0.7 radians, into 16 parts at most. Half: what turns by over 0.67 radians is braked. Double: the root of a negative number.
inline constexpr double kFarthestTurn = 0.9;

/// Of the weights of a row, their sum: a row with less ties nodes to each other, one with more holds its piece too. Weights of glue add up to zero and those of
/// a grasp to one, both up to rounding. Some rows of a held border add up to nearly zero; the first never does, so it holds the piece. Half or double is
/// rounding too.
inline constexpr double kTieWeight = 1e-9;

/// Chunks of batches of full cells, which add to sums of their own, and the least number of batches in one. They decide
/// the order of sums, so recordings hang on them. Nodes that several chunks share have a sum in each: 13 % of them in a sheet of 5,041 cells, 10 % of 50,176. Half the least: 27 and 10 %, double: 6 and 10 %. Half the chunks: 13 and 5 %, double:
/// 13 and 21 %. Recordings of bodies over 512 cells are others with any.
inline constexpr std::size_t kSumChunks = 24, kLeastSumGrain = 128;

/// Of a piece's size at rest: how far a node may move in a 16th of a time step, for `substeps` up to 16 (speed_cap.h). As a spin that is a turn of
/// 0.8 radians, where frozen rotations end (kMostTurn of the session). Of five punched bodies under 300 to 1000 g, whose runs end without it, none ends.
/// Half: none ends either, and spins of 0.4 radians are braked. Double: two of the runs end, as points come apart by more than the body's size.
inline constexpr double kMostWay = 0.4;

/// Passes over contacts that go all of their way; later ones end where the energy has its least (pass_length.h). Most steps need no more, and keep what they have
/// for it. Of a scalpel in a coarse sheet (two cuts of `EdgeResistance`): 3.93 and 4.55 passes a step. A third: 3.47 and 4.59, but crossing-strips 2.44 for 2.32; double: 4.19
/// and 4.86.
inline constexpr int kWholePasses = 3;

/// Of the slope that a pass starts with: how far beyond its zero it may end without being taken back. Three cuts of that scalpel: 3.90, 4.39 and 4.39 passes a step. A
/// tenth: 3.93, 4.55, 4.60; three times: 3.98, 4.41, 4.53. Nothing pulls with more than 0.08 N with any.
inline constexpr double kSteepestEnd = 0.1;

/// Passes at most over bonds that tear: what is left then goes on in the next step. A peel takes 1.056 of theory's force, a double cantilever beam 1.029. Half: 1.064 and
/// 1.042. Double: 1.056 and 1.021, in 1.4 times the time.
inline constexpr int kMostBondPasses = 6;

}  // namespace kerf
