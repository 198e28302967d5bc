// What messages about a body that can't be used tell to do, for people at a command line and for people at the page.
#pragma once

#include <string_view>

namespace kerf {

struct Advice {
  std::string_view command_line, page;
};

inline constexpr Advice kCloseTheHoles{"close the holes (kerf info counts them)", "close the holes"};
inline constexpr Advice kGiveThickness{"say how thick it is: thickness = metres in [body], or --thickness",
                                       "say how thick it is under Thickness"};
inline constexpr Advice kGiveMidsurface{
    "kerf bind BODY --diagnose FILE.ply shows the places, and --collision takes a mesh of your own",
    "a mid-surface of your own can be opened together with it as its collision mesh"};
inline constexpr Advice kGiveCollisionMesh{
    "ask for more triangles, or give a collision mesh of your own; --write-collision FILE.obj saves the one that was "
    "made, --diagnose FILE.ply shows the places",
    "a mid-surface of your own can be opened together with it as its collision mesh"};
inline constexpr Advice kWaysOut[] = {kCloseTheHoles, kGiveThickness, kGiveMidsurface, kGiveCollisionMesh};

}  // namespace kerf
