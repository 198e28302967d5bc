// Tolerances of cutting. Lengths are relative to CellComplex::mean_root_edge where nothing else is said.
#pragma once

#include <cstddef>

namespace kerf {

/// Smaller features would let parameters on one edge coincide after rounding.
inline constexpr double kLeastFeature = 1e-3;

namespace cut {

/// A crossing this near to a visual vertex (part of the crossed edge) moves the vertex's parameter onto the path.
inline constexpr double kWarpFraction = 0.1;
/// None of these leaves a vertex farther from the place of its parameter than this part of the mean root edge, however long visual edges are: so far a
/// drawn lip has teeth. It is what a curve may leave what is drawn. Of the corners of circles in the steak 99 in 100 are below 15 degrees; at half 10, with a twentieth more
/// vertices in lips; at double 20.
inline constexpr double kPlaceReach = 0.002;
/// Faces around a moved parameter, or beside a turned edge, keep at least this part of their planar area.
inline constexpr double kWarpKeepsArea = 0.05;
/// A new vertex sits on its 3D edge no nearer to an end than this part of it.
inline constexpr double kClampFraction = 0.05;
/// A point with more than this barycentric weight at a free vertex takes that vertex.
inline constexpr double kNearVertexWeight = 0.8;
/// A point with less than this barycentric weight of the opposite corner splits the edge instead of the face.
inline constexpr double kNearEdgeWeight = 0.02;
/// Faces made by inserting a point keep at least this part of their parent's planar area.
inline constexpr double kSplitKeepsArea = 1e-3;
/// Mean root edges by which a drawn curve may leave what is drawn. In a picture 800 pixels high a circle of 2.5 edges' radius has no corner of a pixel. Half: a
/// tenth more vertices, and ten times as many curves find no room. Double: corners of a pixel.
inline constexpr double kCurveShows = 0.002;
/// Path tolerances and minimum features from a vertex of the path within which its curve passes it. Half or double: the same circles.
inline constexpr double kCurveFar = 2;
/// Mean root edges that a blade has moved at least before its place is kept for the curve: one that stands in the material for an hour keeps no more.
/// Half: twice as many places of a slow blade. Double: as much as a curve may leave what is drawn.
inline constexpr double kTrailStep = 0.001;
/// Times a curve's height within which what lies beside its chord makes way. Half or double: the same circles to within two that find no room.
inline constexpr double kBesideCurve = 3;
/// Such faces at most. Half or double: the same circles.
inline constexpr std::size_t kBesideFaces = 24;
/// Of the room beside a chord that a curve may take; the rest is what all that lies there is pressed into. Half: curves that leave a chain at a slant are
/// drawn beside their place by half a minimum feature. Above one there is no room.
inline constexpr double kCurveRoom = 0.8;
/// Faces beside a curve that is laid onto its chord keep at least this part of their planar area. Half or double, or fifty times it: the same circles.
inline constexpr double kLaidKeepsArea = 1e-3;
/// Times that triangles too long to follow a curve onto its chord are divided. Half: twice as many curves are drawn as chords. Double: a third fewer.
inline constexpr int kLayRounds = 4;
/// Parts of a curve's way back to a vertex that was rounded to another place. Half or double: the same circles to a hundredth of their error.
inline constexpr int kFadePoints = 8;
/// Two chain parameters nearer than this part of the smallest gap beside them become one column of a wall.
inline constexpr double kPairFraction = 0.3;
/// A flip must improve the angle sum by more than rounding (sine of the excess angle).
inline constexpr double kFlipGain = 1e-9;
/// A flip moves the middle of its quad by no more than this, part of the mean root edge.
inline constexpr double kFlatness = 1e-9;
/// Nor, in the skin, its texture coordinates by more than this. Half or double is rounding of float; at a hundredth, faces of one plane keep edges.
inline constexpr double kTextureFlatness = 1e-6;
/// Faces of the collision mesh keep at least this part of the mean root edge squared.
inline constexpr double kLeastCollisionArea = 1e-14;
/// Minimum features: cuts make no edge of the collision mesh shorter. Of 27 bodies cut a thousand times, at half, edges are half as long; at double, one
/// keeps an angle of 7e-5 degrees in place of 8e-3. Refusals and the oracle's verdicts are the same. At zero, edges of shreds get shorter with every cut.
inline constexpr double kLeastCollisionEdge = 0.02;
/// Such lengths: a path that crosses a shorter edge goes through one of its ends, as both ends and both apexes may leave no room between them. At half,
/// edges get half as short as they should; at double, only shreds have 6 % fewer faces.
inline constexpr double kShortCollisionEdge = 6;

/// Minimum features: an arc so near to a lip is that lip, an end so near to a border is on it. Just over one, so that what has been rounded by a minimum
/// feature is still near itself. At half, cuts along a lip leave slivers and closed strokes stay open; at double, teeth of a comb are severed.
inline constexpr double kPathNear = 1.1;
/// Minimum features along the border to which a mouth of a slit at a slant, and the tip of a wedge between two lips, reach: a blade in its slit is not joined
/// to the one, an arc along a lip may cross the other. At half, one in 500 strokes there and back beside a vertex of the border leaves a crumb; at double
/// none does, as here.
inline constexpr double kPathMouth = 6;
/// Minimum features from an inner vertex within which a path that crosses a close fan goes through it. At half, slits beside an edge of the mesh leave
/// slivers on which contact stumbles; at double, teeth of a comb are severed.
inline constexpr double kPathFan = 1.6;
/// Minimum features by which a bend of a path may be moved aside. Of more than this it waits for room, for as long as the path is less than a feature off. At half, the same
/// circles; at double, fine paths are a twentieth rougher, at four times a quarter.
inline constexpr double kBendAside = 0.05;
/// Minimum features within which a border runs beside a path: two cuts are each rounded by one, and what is near is a little more. Of 960 combs 22 lose a
/// tooth; at half 207, at double 25, and thicker wedges stay attached.
inline constexpr double kBesideReach = 3;
/// Such reaches that a path has come at least, before a border is said to have run beside it all the way. At zero one set in 600 of the oracle keeps a
/// bridge; at double 25 combs lose a tooth.
inline constexpr double kBesideFar = 1;
/// Cosine of 26 degrees to a path's way: from there on a border lies beside it, neither ahead nor behind. At half, the tip of the cut
/// beside counts as ahead, and 124 combs in place of 22 lose a tooth; above one nothing is ahead.
inline constexpr double kBeside = 0.9;
/// Radians of material around a border vertex, 225 degrees: from there on it is the tip or a corner of a slit, and a path that passes it within a
/// minimum feature goes through it. From 195 to 270 degrees the same; at 315, and without it, 2 and 5 of 1,200 paths over the mesh leave a bridge.
inline constexpr double kReflex = 3.927;
/// Mean root edges: what rounding may put a point outside of its face. Half or double is rounding too; at a hundredth, points on edges are in no face.
inline constexpr double kPathOutside = 1e-6;
/// Mean root edges at rest beside a cut along a sheet, within which its stroke cuts nothing more. At half and at double as many knives that are pressed
/// flat part a slab; at zero, lips that swing over the edge lose slivers.
inline constexpr double kPathDone = 0.25;
/// Faces around a point that are looked at. At half, crowded places are not seen whole; at double nothing more is.
inline constexpr int kFacesAround = 64;
/// Part of the way to the next border in front of a wall that its vertices may stray, at mid-depth and per distance from the skin. Two walls that face each
/// other stray towards each other, so from half the way on they may meet.
inline constexpr double kMostOfTheWay = 0.4, kNearTheSkin = 0.8;
/// Part of the distance from a corner, times the tangent of half its angle: at 1 two walls meet in the middle between them.
inline constexpr double kMostOfTheCorner = 0.8;
/// Cosine of the angle from straight ahead within which a border is in front.
inline constexpr double kInFront = 0.3;
/// Amplitudes of a rough wall from which borders in front of it are looked for. At half, walls meet in strands two amplitudes wide; at double nothing
/// changes, as 0.4 of the way is more than an amplitude.
inline constexpr double kRoughReach = 2.5;
/// Border edges on either side that count as the same lip. At half, long arcs between close vertices leave their lip; at double nothing changes.
inline constexpr int kSameLip = 8;
/// Cosine between a face and the blade, below which the blade lies along it. At half, chops of vaults cut one of two layers; at double, blades that lean
/// over far cut what they only pass.
inline constexpr double kPathFlat = 0.1;
/// The same, from the first cut along the blade in a stroke on: what rolls on its side before it gives way is still cut. At half, two in a hundred strips that are
/// held far from the blade hang on by strands; at double, the same strips and slabs part.
inline constexpr double kPathLeans = 0.3;
/// Mean root edges at rest within which of a cut along the blade all is of one sheet, however it lies. Of 82 strips that roll on their side one hangs on by
/// a strand, at half too; at double none does, at zero four. Layers that lie nearer at rest are cut together.
inline constexpr double kPathBeside = 1;
/// Times that arcs whose faces others have divided are looked for again. At half, dice with a blade that cuts all layers leave a layer; at double nothing
/// changes.
inline constexpr int kPathTries = 8;
/// Bends of a move: where a path leaves a border and where it turns. At half, a turn after a border is cut off; at double nothing changes.
inline constexpr int kPathBends = 2;
/// Parts of a move that count as different times. At half or double the order of layers that are met at once is by rounding.
inline constexpr double kPathMoments = 1e7;
/// Radians: a blade that turns less against the material goes straight through it. At half, twice the work; at double, curved strips are cut beside their place by a hundredth of the blade.
inline constexpr double kPathTurn = 0.05;
/// Mean root edges squared: of a smaller piece it is looked at whether it is a crumb. At half, slivers of a third of an edge are let through unseen; at
/// double, each cut costs a few faces more.
inline constexpr double kCrumbArea = 0.05;
/// Minimum features: a small piece of less mean width is not cut off. Of 2,000 polylines 13 leave more when followed back, and 5 when drawn twice; at half 32
/// and 21, without it 35 and 24. At one 5 and 1, and 200 strokes to and fro through one place leave eight times the faces.
inline constexpr double kCrumbWidth = 0.6;
/// Minimum features: a shorter path that would cut off a crumb is not made. At half, with crumbs up to one feature wide, the same strokes leave an eighth more
/// faces; at double and more the same.
inline constexpr double kCrumbPath = 8;
/// Mean root edges: that shorter path, however large the minimum feature. Of 1,920 stars beside a hole, with minimum features of 0.25, one is not whole; at half
/// and double the same, at four times two, without it ten.
inline constexpr double kMostCrumbPath = 0.2;
/// Mean root edges cubed: a small piece that encloses less is not cut off. Half or double, or ten times either, is rounding of the skin's volume.
inline constexpr double kCrumbVolume = 1e-8;
/// Times the volume of dust: what has more between its sides, by the offsets of the collision mesh, is none. Of 132 pieces below a thousandth of their
/// body it had 0.67 to 3.4 times what the skin encloses. At half, 3 of those are left lying; at double, a cut that takes something off costs a few faces more.
inline constexpr double kDustPrisms = 4;
/// Of a wall's edge: a column's middle is so far below the skin beside its ends. Of 9,600 walls in a scanned meniscus 431 leave it without bows, and 10
/// with them. At half two more, at double none; at zero, walls beside an upright rim have faces without area.
inline constexpr double kBowMargin = 3e-2;
/// Of a wall's edge: from the rim on each middle is so much farther in. At half or double the same 10 walls.
inline constexpr double kBowGap = 1e-3;
/// Cosine between the way from the rim and skin that is cleared by it. At half the same walls; at eight times,
/// without kBowAhead, 16 more.
inline constexpr double kBowSlope = 0.05;
/// Half thicknesses along the path by which a column's middle may be off its place of the mid-surface. At half the same walls; at double two more,
/// and the farthest place is four times as far out.
inline constexpr double kBowAhead = 0.1;
/// Half thicknesses along the path within which the neighbours of a column that bows do so too, less and less. At half two more of those walls; at
/// double none.
inline constexpr double kBowReach = 0.5;
/// Faces that a way led over the mesh may touch. At half, ways around crowded vertices are not found; at double nothing more is.
inline constexpr int kLeadFaces = 96;
/// Of the reach of a way led over the mesh: what one more edge costs. Half or double is the same: of ways that are as straight the shortest is taken.
inline constexpr double kLeadStep = 1e-3;
/// Mean root edges from a blade within which vertices say how the material turns and stretches there. Half or double: the same strokes of moving bodies.
inline constexpr double kMoveReach = 2;
/// Steps of Newton's method to how material turns, from rest. At half, what turns by more than 2 radians in one move is taken to turn less; as it is, by more
/// than 2.5; at double, by more than 3.
inline constexpr int kMoveIterations = 10;
/// Part of its square of what material spreads across a blade, as an area: from there on it is a line, and does not say how it turns. Half or double: the
/// same arcs of random sheets.
inline constexpr double kMoveFlat = 1e-6;
/// Of its size: material that is squeezed more across the blade in one move, or stretched as much, does not say how it turns. Half or double: the same.
inline constexpr double kMoveSqueezes = 0.1;
/// Of how far a blade is from the origin: what a box is grown by that is asked whether the blade passes it. Half or double is rounding too; at zero, a face that
/// only touches the blade's line may be missing where its neighbour is found, and an arc breaks off.
inline constexpr double kMoveRounding = 1e-12;
/// Of an edge's length: so near to it the blade is when it crosses it, or that moment is rounding. Half or double: the oracle's verdicts are the same. At zero a comb
/// loses a tooth, as moments are exchanged for others as good.
inline constexpr double kMoveAside = 1e-3;
/// Material that turns less in a move keeps still. Half or double is rounding.
inline constexpr double kMoveStill = 1e-9;
/// Of a circle's radius: the finest and coarsest tolerance of its outline. The finest has 182 corners, and half of it 256, where 200 are the most.
/// The coarsest has 8 corners (at half it, 5 would do, and 8 are the least; double is the same).
inline constexpr double kFinestOutline = 1e-4, kCoarsestOutline = 0.05;
/// Margins of a punch that a triangle's box lies beside that of the outline, so that the triangle is well outside without its depths: one, and rounding.
/// Half: triangles count so that the margin is to spare, and pieces inside hang on. Double: depths say the same, for more work.
inline constexpr double kPunchFar = 1 + 1e-6;

}  // namespace cut

}  // namespace kerf
