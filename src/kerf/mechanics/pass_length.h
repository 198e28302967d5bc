// How far a pass over contacts goes towards its solution.
//
// A pass solves with the rows that press and slide as the last one left them. Where others open and close on the way, its solution may lie beyond the one that is
// looked for, and the next one on the other side again: passes go round in cycles. With the limits of friction held, rows and
// material have a convex energy. So its slope along the way has one zero, and a pass that comes past it ends there.
//
//   -slope |*
//          |  *                 rows at work as the pass has them: straight; as they are: bent where one opens or closes
//          |    *
//          |      * * *
//        0 +------------*------*-> share of the way
//          0            |      1
//                  the pass ends
//
// Newton's method with a line search: Nocedal and Wright, Numerical Optimization, 3.1.
#pragma once

namespace kerf {

class MechanicsModel;
struct StepWorkspace;

/// Before a pass is solved, with its residual: remembers where it starts.
void start_pass(StepWorkspace& workspace);

/// After it is solved, and before the rows are updated: takes the solution and its residual back to where the pass ends. Returns the share of the way,
/// 1 where it goes all of it. h: s. O(nodes), and rows times halvings.
double end_pass(const MechanicsModel& model, double h, bool parallel, StepWorkspace& workspace);

}  // namespace kerf
