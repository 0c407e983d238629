/// Planar worlds: three degrees of freedom a body, x and y of its centre of mass and its angle.
///
/// The plane is z = 0 of W; bodies turn about z. What is told a planar world must lie in it: points
/// and vectors without z, torques and angular velocities without x and y, attitudes about z;
/// anything else is refused (Result::out_of_plane), never bent into it. Half-spaces alone have
/// another attitude: their z_B, the normal, lies in the plane.
///
/// Shapes are those of planar_pairs.h, 1 m deep for their mass, a box as it says. Of its inertia
/// the moment about z counts.
#pragma once

#include <string_view>

#include "protocol/command.h"
#include "server/dynamics/free_flight.h"
#include "server/world/body_table.h"
#include "server/world/forces.h"

namespace cradle {

/// What of it leaves the plane and why, to go on after the body's name; empty: nothing. Its mass
/// must have its centre in the plane, within 1e-9 of its radius of gyration, and z among its
/// principal axes, within 1e-9 of the largest moment.
std::string_view out_of_plane(const BodySpec& spec, const MassProperties& mass);
std::string_view out_of_plane(const Motion& motion, ShapeKind shape);
std::string_view out_of_plane(const Wrench& wrench);
std::string_view out_of_plane(const Spring& spring);
std::string_view out_of_plane_gravity(const Vec3& gravity_W);

/// What a stored geometry weighs at density 1 in a planar world, or in one of space.
MassDistribution geometry_mass(const StoredGeometry& geometry, bool is_planar);

/// As `mass_properties`, of a shape of the plane; `stored` is its `geometry_mass`, or null.
Result planar_mass_properties(const BodySpec& spec, const MassDistribution* stored,
                              MassProperties& properties);

/// A mass that `out_of_plane` accepts, as the plane needs it: axes of B, J about z, the same about
/// all axes, of which no load turns the body about x and y. So what moves bodies in space sees no
/// gyroscopic term, and contacts no freedom but those of the plane.
MassProperties planar(const MassProperties& mass);

/// Clears what has no place in the plane: of a body in flight the rounding of methods that move
/// bodies in space; of the body in slot `i` also what was accepted within a tolerance.
void keep_in_plane(Flight& body);
void keep_in_plane(BodyTable& bodies, std::size_t i);

}  // namespace cradle
