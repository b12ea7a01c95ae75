#include "scene/run/whole_report.h"

#include <gtest/gtest.h>

#include "scene/read/scene.h"

namespace porthos::scene::whole_report_test {
namespace {

TEST(WholeReport, TheCostsOfItsPhasesAddUp) {
  WholeReport whole{Scene{}};
  RunReport phase;
  phase.cost = {.steps = 2, .evaluations = 3, .sweeps = 5, .factorisations = 7};
  whole.add(phase, 0);
  whole.add(phase, 1);
  const auto& c = whole.report().cost;
  EXPECT_EQ(c.steps, 4);
  EXPECT_EQ(c.evaluations, 6);
  EXPECT_EQ(c.sweeps, 10);
  EXPECT_EQ(c.factorisations, 14);
}

}  // namespace
}  // namespace porthos::scene::whole_report_test
