// Numbers that decide in a solve, for pieces in flight (step.cpp) and passes over contacts (pass_length.h), and what speeds it may end with (speed_cap.h). Of those in flight, each: its unit, where it comes from, and what half and double of it do to 180 runs of spinning slabs, strips
// and plates (0.03 to 100 MPa, 5 to 60 rad/s, steps of 5 and 16.7 ms, half of them bent at the start): one gains 8 % of its kinetic energy, in 25.6 iterations a step.
#pragma once

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
