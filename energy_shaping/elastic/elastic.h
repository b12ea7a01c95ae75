#pragma once
/// Arms with elastic joints and their regulators.
#include "energy_shaping/elastic/elastic_plant.h"
#include "energy_shaping/elastic/motor_side.h"
#include "energy_shaping/elastic/structure_preserving.h"
