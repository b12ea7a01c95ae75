#pragma once
#include "space/parts.h"

/// Common functions of the model of parts and its systems. Private to parts*.cpp and torquers.cpp.
namespace porthos::space {

/// Whether the latch dissipates power.
bool damped(const SoftLatch& l);
/// The node of a free base whose coordinates come first in the mechanism's state; -1 if there is
/// none.
int free_base(const mechanics::Mechanism& m);

}  // namespace porthos::space
