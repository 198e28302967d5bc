// Numbers that decide what an edge presses against and what it has cut (session_tools.cpp), when a part of a step is taken
// again (session_contact.cpp), and how fixed regions hold material (held_material.cpp, session_hold.cpp).
#pragma once

namespace kerf {

/// Of a time: what begins so much before another ends begins after it. Sums of decimal fractions are off by 1e-16. Half and double are rounding too.
inline constexpr double kSameTime = 1e-9;

/// Young's modulus times the edge of a cell: stiffness with which a border that crosses a whole cell is held there, as if the cell were longer by one over this. At half the
/// meniscus sags by 2 % more; at 100 it takes 36 iterations a step for 28, and sags by 2 % less.
inline constexpr double kHoldStiffness = 25;

/// Parts of a line through a cell that are looked at for borders. A region that lies between two such places is not seen; at half, one of a quarter of a cell.
/// At double, tracing a border takes twice as long.
inline constexpr int kLineParts = 8;

/// How often the way between two places is then halved: to a thousand millionth of a cell. At half, borders are off by a 30,000th, which shows in nothing but bits.
inline constexpr int kHalvings = 30;

/// Of a cell, or of a copy's material: less than this of it held, or not held, is nothing. Clamps of shipped scenes lie on lattice planes up to rounding, 1e-15. At 0.1 a
/// border through a cell would be off by as much; below 1e-9 rounding decides.
inline constexpr double kLeastShare = 1e-3;

/// Of the largest pivot of a border's springs: a smaller one is rounding, 1e-16 times the points that are summed. Half and double change nothing.
inline constexpr double kLeastRow = 1e-10;

/// Of the body's size: what fixed nodes may lie beside a line, or a point, and be noted as one. Nodes of a lattice lie on lines up to rounding, so half and double
/// change nothing.
inline constexpr double kHingeWidth = 1e-6;

/// Cosine between an edge and the normal of the material at the end of its cut, at least: else the edge lies along the material, and its length there, half the thickness
/// over this, would mean nothing.
inline constexpr double kUpright = 0.05;

/// Cosine between the way of an edge and that to a vertex that carries its force ahead of the end of the cut, at least.
inline constexpr double kAhead = 0.2;

/// Cosine between an edge and the normal of a face that it lies along, at most; and between that normal and the way of the edge, at least.
inline constexpr double kLies = 0.3, kLandsOn = 0.5;

/// Mean collision edges between the places of such a face that are looked at.
inline constexpr double kLook = 0.02;

/// Mean collision edges: material nearer to a lip, across the edge, is cut. Cuts run up to 0.2 beside the blade.
inline constexpr double kBesideCut = 0.3;

/// Of the thickness: lips that lie farther beside where a leaning blade passed the skin are noted. A wall off by this looks slanted. In a plate this is a lean
/// of 11 degrees, half 6, double 22.
inline constexpr double kBesideBlade = 0.1;

/// Mean collision edges between the places at which an edge that lies along the skin is felt. Edges that stand across the thickness are felt at both ends of it.
inline constexpr double kSampled = 0.5;

/// Parts of an edge that a step along it outside of material is at least, for material without thickness. At half, an edge 8,192 half thicknesses long may lead
/// over it unseen; at double, a step takes longer where a long edge lies just beside such material.
inline constexpr int kStepsOutside = 16384;

/// How often the way between two samples of an edge, half a half thickness, is halved to find where the edge enters the material. At half, its length inside is off by up to a
/// 64th of the thickness; this by up to a thousandth, and at double by nothing that shows.
inline constexpr int kBorderHalvings = 8;

/// Mean collision edges from an edge within which vertices say how the material at it moves. At a fifth or three times as many strips that roll on their
/// side part, of 82; at ten times, three more of them hang on by strands.
inline constexpr double kAtEdge = 0.1;

/// Change of a cell's deformation gradient in a part, 1: a turn of 0.7 radians. A part that comes to more of it than this is taken again
/// in shorter ones. Parts are made by what turns as they begin; what tips over under a load begins at rest. A scrap that lies on a plane
/// under 100 g comes to 43 m/s without it. Half: 1.7 m/s, and steady spins are taken twice. This: 2 m/s. Double: 4 m/s.
inline constexpr double kMostTurned = 2;

/// Softer body's Young's moduli over its thickness: stiffness of a bond without a value. Layers of a beam then bend as one. A double cantilever beam of 60 cells and a
/// zone of 4 takes 1.029 of theory's load. Half: 1.025. Double: 1.029, in a third more time. Ten times: its worst error is 33 % for 7 %, at twice the iterations.
inline constexpr double kBondFirmness = 1;
/// Squares of the strength over the toughness: stiffness of a bond at least. A quarter of what tearing takes then comes before the strength is passed. Half: half of it,
/// and the bond snaps; the quarter of this is refused. Double: an eighth, with a stiffer bond to solve for.
inline constexpr double kBondRise = 2;
/// Bond points along the edge of a cell without a spacing. That beam takes 1.029 of theory's load. Half: 1.033. Double: 1.025, in 1.4 times the time.
inline constexpr double kPointsPerCell = 4;
/// Cosine between the normals of skins that are bonded, at least: 37 degrees. At half, 66 degrees, rims bind too. At 1 only flat skins do. Flat layers are bonded alike.
inline constexpr double kBondFacing = 0.8;
/// Thicknesses of the thinner body: how far bonded skins may be from each other without a reach. Half leaves skins of scans apart that nearly meet. Double joins skins
/// with a gap of a fifth.
inline constexpr double kBondReach = 0.1;
/// Thicknesses of the thinner body, to either side of a bond: a blade that passes there severs it. Half: 0.25 mm for skin, which no hand keeps to. Double: a blade in
/// the middle of a layer severs both of its skins.
inline constexpr double kBondSevered = 0.25;
/// Points of a [[bond]] at most. One takes about 400 bytes, and 8 of every undo step: 200 and 4 MB together. Half and double: half and double of that.
inline constexpr double kMostBondPoints = 500000;

/// Damage from which on bonds leave it to contact to keep skins apart. A bond pushes as it pulls, by a tenth of its stiffness then.
inline constexpr double kLooseBond = 0.9;

/// Spacings of bond points: a contact of two bonded skins is left out where a point that holds lies so near to its one end. A point lies within 0.75 of all of its
/// part of a triangle. Half leaves out the same in a flat pad at rest; at 0.4 it has 196 contacts. Double: skins that peel have no contact within 3 of the front.
inline constexpr double kBesideBond = 1.5;
/// The same of the contact's other end, which is across the gap. Half and double leave out the same in a flat pad, at rest and with a lip pressed.
inline constexpr double kAcrossBond = 3;

/// Of the tolerance of a solve: what steps are solved to in which points of bodies touch each other, or lips a blade between them. What a looser solve leaves undone moves light rims by
/// more than contacts give, and they open and close without end. A scalpel along planes of cells (`EdgeResistance`) is pushed aside by 0.7 N at most, in 169 to 241 iterations a step. At 1:
/// by 3.7 N in 176 to 354. Half: 0.7 N in 156 to 233; double: 0.9 N in 218 to 256.
inline constexpr double kPairTolerance = 0.1;

/// Path tolerances by which the outline of a round punch may stray from its circle. Walls of upright bites of 2.5 to 5 mm in the model meniscus stay within 0.13 mm of the
/// tool, 0.02 mm rms. Half: 0.12 and 0.016, with 1.4 times the corners. Double: 0.16 and 0.03.
inline constexpr double kOutlineOfPath = 0.25;

}  // namespace kerf
