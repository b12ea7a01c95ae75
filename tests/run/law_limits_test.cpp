// Notes on laws that are hindered: at their limits, not defined, wheels that are full.
#include <gtest/gtest.h>

#include "scene/session/memory_run.h"
#include "tests/run/shipped.h"

namespace porthos::test::law_limits_test {
namespace {

/// The note on a law of a run, or "".
std::string hindrance_in(const scene::Scene& s) {
  const auto r = scene::run_in_memory(s, scene::assemble(s), {});
  for (const auto& note : r.notes)
    if (note.find("its certificate does not hold there") != note.npos) return note;
  return "";
}

}  // namespace

TEST(LawLimits, ALawAtItsLimitIsTold) {
  const auto with = [](const std::string& limit) {
    TemporaryFolder folder;
    return hindrance_in(shipped(
        folder, "slew", 20,
        {{"damping = [90.0, 90.0, 90.0]", "damping = [90.0, 90.0, 90.0]\nlimit = " + limit}}));
  };
  const std::string told = with("0.01");
  EXPECT_TRUE(says(told, "controller 'attitude' at wheel_")) << told;
  EXPECT_TRUE(says(told, "asks for more than its limit of 0.01 at ")) << told;
  EXPECT_EQ(with("1000.0"), "") << "control";
}

TEST(LawLimits, AStartWhereADesignIsNotDefinedIsTold) {
  TemporaryFolder folder;
  const std::string start = "position = 2.356", beyond = "position = 1.2";
  const std::string told = hindrance_in(shipped(folder, "cart_pole_idapbc", 2, {{start, beyond}}));
  EXPECT_TRUE(says(told, "is not defined (M_d > 0 fails) at ")) << told;
  EXPECT_TRUE(says(told, "first at 0 s")) << told;
  TemporaryFolder other;
  EXPECT_EQ(hindrance_in(shipped(other, "cart_pole_idapbc", 2, {})), "") << "control";
}

}  // namespace porthos::test::law_limits_test
