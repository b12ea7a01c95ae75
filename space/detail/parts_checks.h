#pragma once
#include "space/parts.h"

/// What the model of parts and its systems both ask. Private to parts*.cpp and torquers.cpp.
namespace porthos::space {

/// Whether the latch loses power.
bool damped(const SoftLatch& l);
/// The node of a free base whose state begins the mechanism's; -1 if there is none.
int free_base(const mechanics::Mechanism& m);

}  // namespace porthos::space
