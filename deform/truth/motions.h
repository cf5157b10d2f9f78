// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "deform/truth/family.h"

namespace tetwarp::truth {

// The families' fields, on the lattice of the subject: `Family::make`.

/// Elastic (deform/fields/elastic.h). Towards the faces of the volume the component across them fades to 0, so that
/// nothing moves in or out: it is 0 from the last vertex on, behind which no voxel lies on a vertex.
VertexField elastic_motion(const Subject& subject, const Values& values, const Limits& limits, const Control& control);
/// The same displacement everywhere.
VertexField shift_motion(const Subject& subject, const Values& values, const Limits& limits, const Control& control);
/// A rotation about the middle of the lattice.
VertexField rotation_motion(const Subject& subject, const Values& values, const Limits& limits, const Control& control);
/// u_z = -A h m, u_y = -rise A h m f: h is a hill along z about the lowest lung, m fades to 0 towards bones and the
/// table, and f falls from 1 at the front of the body to 0 at its back.
VertexField breathing_motion(const Subject& subject, const Values& values, const Limits& limits,
                             const Control& control);
/// Inside a tube along the third axis of the lattice, around the convex hull of the lungs seen along that axis: a shift
/// along it, A h m as in breathing, where m looks at bones deep inside the tube alone. Outside nothing moves. The cells
/// through which the tube goes are divided (deform/simulate/divided_lattice.h).
/// @throws InputError where more than a thousandth of the voxels are torn open or owned twice
VertexField slip_motion(const Subject& subject, const Values& values, const Limits& limits, const Control& control);
/// A bending about the axis L. Its angle grows evenly from the lowest to the highest bone; the line that keeps its
/// length goes through the middle of the bones. Each label of the role moves rigidly, as that line does at its middle,
/// with the vertices at most a cell's diagonal from it; where two labels are nearer to each other than that, each
/// vertex goes with the nearer one. Between bones their motions and the bending are weighted by inverse squared
/// distances (Shepard 1968).
VertexField flexion_motion(const Subject& subject, const Values& values, const Limits& limits, const Control& control);
/// About the middle of the organ, in the ball of radius R that holds it, lengths are scaled by ratio^(1/3). Outside
/// that ball r goes to (r^3 + (ratio - 1) R^3)^(1/3), which keeps volume, up to 2.5 R, and fades to rest at 5 R.
VertexField filling_motion(const Subject& subject, const Values& values, const Limits& limits, const Control& control);
/// As filling inside the ball; outside it the shift fades to rest at 3 R.
VertexField shrinkage_motion(const Subject& subject, const Values& values, const Limits& limits,
                             const Control& control);

}  // namespace tetwarp::truth
