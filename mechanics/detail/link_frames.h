#pragma once
#include <vector>

#include "mechanics/mechanism.h"

namespace porthos::mechanics {

/// Turns and shifts the frames of bodies on joints about z, about and along their own z axis, so
/// that the placements of such joints are two screws (Node::axial), and in a chain of them one.
/// Coordinates and the user's frames stay what they were; inertias and poses are given in the new
/// frames.
void choose_link_frames(std::vector<Node>& nodes, std::vector<BodyFrame>& bodies);

}  // namespace porthos::mechanics
