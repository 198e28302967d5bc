// What a step of mechanics did.
#pragma once

namespace kerf {

struct StepReport {
  int iterations = 0;  ///< all of them, with and without the coarse space
  int block_jacobi_iterations = 0;
  bool two_level = false;  ///< the coarse space was used
  double residual = 0;     ///< relative to the right-hand side at the end
  bool stopped_by_floor = false;
  bool cap_hit = false;        ///< max_iterations reached: the step is less exact than asked for
  bool factorised = false;     ///< solved directly, as asked for or as iterations came to no end
  int contacts = 0;            ///< rows given
  int pressing = 0;            ///< those of them that carry a force
  int sliding = 0;             ///< those of them that slide
  int passes = 1;              ///< linear solves, while contacts opened and closed
  double deepest_overlap = 0;  ///< m, of all rows at the end of the step
  int bonds_broken = 0;        ///< points of bonds that tore
  int inverted_elements = 0;   ///< with negative volume at the start of the step
  double kinetic_energy = 0;   ///< J, after the step
  int slowed_nodes = 0;        ///< of a session: nodes whose speed was capped (speed_cap.h), in all parts together
  double fastest_slowed = 0;   ///< m/s: the fastest of them before
  double seconds_forces = 0, seconds_setup = 0, seconds_solve = 0, seconds_contact = 0, seconds_total = 0;
};

}  // namespace kerf
