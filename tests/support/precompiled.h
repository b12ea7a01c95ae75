#pragma once
// What most tests include, compiled once for all of them (CMakeLists.txt). Every test includes what
// it uses all the same.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <random>

#include "integrators/catalogue.h"
#include "mechanics/mechanical_model.h"
#include "phs/system/check.h"
#include "scene/run/run_report.h"
