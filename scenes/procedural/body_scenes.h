// Built-in scenes of many bodies: twist, shuffle, soup, orbits, teleport, hall.
#pragma once

#include "scenes/procedural/surfaces.h"

namespace mray {

// `triangles` is about how many to make; a scene has at least as many as its shape needs.

/// Boxes between the ends turn in proportion to their height.
DeformingMesh make_twist(std::uint64_t triangles);
/// Triangles change places at each whole frame, which degrades a refitted tree fastest.
DeformingMesh make_shuffle(std::uint64_t triangles);
DeformingMesh make_soup(std::uint64_t triangles);
DeformingMesh make_orbits(std::uint64_t triangles);
/// The balls of orbits jump at every third frame.
DeformingMesh make_teleport(std::uint64_t triangles);
/// x from -20 to 20, y from 0 to 9, z from -7 to 7.
DeformingMesh make_hall(std::uint64_t triangles);

}  // namespace mray
