// How large the triangles of the collision mesh should be where.
#pragma once

#include "kerf/midsurface/mid_sheet.h"

namespace kerf::mid {

struct SheetSizes {
  Column<double> size;  ///< |V| of the sheet: wanted edge length, metres
  double largest = 0;   ///< metres
  double need = 0;      ///< triangles that the bends ask for, whatever the target is
};

/// Edges whose chord stays within a fifth of the half thickness of the bent sheet, graded, and cut off at the length that
/// gives `target` triangles in all. `limit`: |V|, no longer than that, metres; graded here.
SheetSizes sheet_sizes(const MidSheet& sheet, double target, Column<double> limit);

/// Limits that let every border be a hexagon at least, |V|; HUGE_VAL inside.
Column<double> border_limits(const MidSheet& sheet);

/// Lets border edges follow round holes and hollows: limits become smaller there. The triangles for that are part of the target, or are added to it, up
/// to what bends may ask for.
///
///    _____a_________b_____    What lies between the chord a - b and the rim would be cut where there is no material:
///          \__   __/          a blade in it has not come to the rim.
///    hole     '-'
void follow_hollows(const MidSheet& sheet, bool add, double& target, Column<double>& limit);

}  // namespace kerf::mid
