#pragma once
/// Arms with elastic joints and their regulators.
#include "energy_shaping/elastic_plant.h"
#include "energy_shaping/motor_side.h"
#include "energy_shaping/structure_preserving.h"
