// Runs that go on: a finished run extended bit for bit, and a run that starts from a record of
// another one; and what is refused.
#include <fmt/format.h>

#include <cmath>

#include "scene/files/hdf5_reader.h"
#include "scene/session/extension.h"
#include "scene/session/memory_run.h"
#include "scene/session/replot.h"
#include "tests/run/shipped.h"

namespace porthos::test::extension_test {
namespace {

/// A scene of two rods, with a sampled controller so that more than the state is continued.
scene::Scene arm(const TemporaryFolder& folder, const std::string& name, const std::string& initial,
                 double duration, const std::string& more = "", const std::string& run = "") {
  write_bytes(folder / "arm.urdf", arm_urdf());
  write_bytes(
      folder / (name + ".toml"),
      fmt::format("[model]\nurdf = \"arm.urdf\"\nbase = \"fixed\"\n[environment]\ngravity = "
                  "\"uniform\"\nvector = [0, 0, -9.81]\n[initial]\n{}\n[integrator]\nmethod = "
                  "\"gauss8\"\nstep = 0.01\n[run]\nduration = {}\nrecord_every = 0.05\n{}\n{}",
                  initial, duration, run, more));
  return scene::read_scene((folder / (name + ".toml")).string());
}
const std::string bent =
    "joints.shoulder = { position = 3, velocity = 4 }\njoints.elbow = { position = 1 }";
const std::string held =
    "[[element]]\ntype = \"controller\"\njoint = \"elbow\"\nstiffness = 30\ndamping = 3\nrate = "
    "7.6923076923076925\n";  // 13 steps, so that the end is between two instants

scene::RunReport extended(scene::Scene s, const fs::path& out, double to,
                          std::int64_t stop_at = -1) {
  scene::extend_to(s, out.string(), to);
  const auto a = scene::assemble(s);
  scene::reopen(out.string(), s, a);
  auto o = into(out, true);
  o.stop_at = stop_at;
  return scene::run(s, a, o);
}
template <class F>
std::string refusal_of(F f) {
  try {
    f();
  } catch (const InvalidArgument& e) {
    return e.what();
  }
  return "";
}
scene::RunReport run_into(const scene::Scene& s, const fs::path& out) {
  return scene::run(s, scene::assemble(s), into(out));
}

}  // namespace

TEST(Extension, ARunAndItsContinuationAreTheBitsOfALongerRun) {
  for (const auto& [more, run] :
       {std::pair{held, std::string()}, {held, "extrema = \"all\"\nlow_words = true"}}) {
    TemporaryFolder folder;
    const auto whole = arm(folder, "a", bent, 4, more, run);
    const auto all = run_into(whole, folder / "whole");
    auto half = whole;
    half.duration = 1.5;
    run_into(half, folder / "parts");
    const auto r = extended(whole, folder / "parts", 4);
    EXPECT_EQ(r.steps, 400);
    EXPECT_EQ(r.final_state.x, all.final_state.x);
    EXPECT_EQ(r.final_state.lo, all.final_state.lo);
    EXPECT_EQ(r.energy.rms_rel_error, all.energy.rms_rel_error);
    EXPECT_EQ(read_bytes(folder / "whole/run.h5"), read_bytes(folder / "parts/run.h5"));
    // Again, in two parts of which the first is interrupted.
    EXPECT_TRUE(extended(whole, folder / "parts", 6, 470).interrupted);
    EXPECT_EQ(extended(whole, folder / "parts", 6).steps, 600);
    auto longer = whole;
    longer.duration = 6;
    run_into(longer, folder / "longer");
    EXPECT_EQ(read_bytes(folder / "longer/run.h5"), read_bytes(folder / "parts/run.h5"));
    // Negative control: another start has other bytes.
    run_into(arm(folder, "b", "joints.shoulder.position = 3.1", 6, more, run), folder / "other");
    EXPECT_NE(read_bytes(folder / "longer/run.h5"), read_bytes(folder / "other/run.h5"));
  }
}

TEST(Extension, InOrbitToo) {
  TemporaryFolder folder;
  auto s = shipped(folder, "ets_vii_orbit", 100);
  s.record_every = 5;
  run_into(s, folder / "whole");
  s.duration = 40;
  run_into(s, folder / "parts");
  extended(s, folder / "parts", 100);
  EXPECT_EQ(read_bytes(folder / "whole/run.h5"), read_bytes(folder / "parts/run.h5"));
}

TEST(Extension, WhatCannotBeContinuedIsSaid) {
  TemporaryFolder folder;
  const auto s = arm(folder, "a", bent, 1);
  const auto refusal = [&](const scene::Scene& scene, double to) {
    return refusal_of([&] { extended(scene, folder / "out", to); });
  };
  EXPECT_TRUE(says(refusal(s, 2), "has no finished run"));
  run_into(s, folder / "out");
  EXPECT_TRUE(says(refusal(s, 1), "ends at 1 s, expected a later time"));
  EXPECT_TRUE(says(refusal(arm(folder, "b", "joints.elbow.position = 1", 1), 2),
                   "is of another scene: the scene file has changed"));
  auto with_events = s;
  with_events.events.emplace_back();
  EXPECT_TRUE(says(refusal(with_events, 2), "with events cannot be extended"));
  // Records that were changed are noticed.
  const auto file = folder / "out/run.h5";
  const auto bytes = read_bytes(file);
  run_into(arm(folder, "c", "joints.elbow.position = 1", 1), folder / "other");
  write_bytes(file, read_bytes(folder / "other/run.h5"));
  EXPECT_TRUE(says(refusal(s, 2), "does not hold the records of the run"));
  write_bytes(file, bytes);
  EXPECT_EQ(extended(s, folder / "out", 2).steps, 200);
  auto odd = s;
  odd.duration = 1.005;
  run_into(odd, folder / "odd");
  EXPECT_TRUE(
      says(refusal_of([&] { extended(odd, folder / "odd", 2); }), "between two whole steps"));
}

TEST(StartFrom, TheStatesOfAnyRecordWithTheirLowWords) {
  TemporaryFolder folder;
  const auto first = arm(folder, "a", bent, 2, "", "low_words = true");
  const auto all = run_into(first, folder / "first");
  const auto again = arm(folder, "b", "from = \"first\"\nat = 0.75", 1.25);
  const auto a = scene::assemble(again);
  EXPECT_EQ(a.initial.turns.size(), 2u);
  EXPECT_NE(a.initial.lo, std::vector<double>(4, 0.0));
  const auto r = scene::run_in_memory(again, a, {});
  EXPECT_EQ(r.final_state.x, all.final_state.x);
  EXPECT_EQ(r.final_state.lo, all.final_state.lo);
  EXPECT_EQ(r.final_state.turns, all.final_state.turns);
  EXPECT_GT(std::abs(all.final_state.turns[0]), 0) << "it turned over";
  // The last record, with another controller; without low words a note says so.
  run_into(arm(folder, "c", bent, 2), folder / "plain");
  const auto plain = scene::assemble(arm(folder, "d", "from = \"plain\"", 1, held));
  EXPECT_EQ(plain.initial.x, all.final_state.x);
  EXPECT_TRUE(says(plain.notes.back().text, "low words were not recorded"));
}

TEST(StartFrom, AFreeFlyerGoesOnToRounding) {
  TemporaryFolder folder;
  const auto text = [](const std::string& initial, double duration) {
    return fmt::format(
        "[model]\nurdf = \"arm.urdf\"\nbase = \"free\"\n[environment]\ngravity = \"uniform\"\n"
        "vector = [0, 0, -9.81]\n[initial]\n{}\n[integrator]\nmethod = \"gauss8\"\nstep = 0.01\n"
        "[run]\nduration = {}\nrecord_every = 0.05\n",
        initial, duration);
  };
  write_bytes(folder / "arm.urdf", arm_urdf());
  const auto read = [&](const std::string& name, const std::string& initial, double duration) {
    write_bytes(folder / name, text(initial, duration));
    return scene::read_scene((folder / name).string());
  };
  const std::string moving =
      "base.position = [3, 0, 0]\nbase.linear_velocity = [0, 1, 2]\nbase.angular_velocity = [0.1, "
      "0.2, -0.3]\njoints.elbow.velocity = 2";
  run_into(read("whole.toml", moving, 2), folder / "whole");
  run_into(read("half.toml", moving, 1), folder / "half");
  run_into(read("rest.toml", "from = \"half\"", 1), folder / "rest");
  const scene::Hdf5Reader a(folder / "whole/run.h5"), b(folder / "rest/run.h5");
  double off = 0, moved = 0;
  for (const char* name : {"state/base.position", "state/base.attitude", "state/elbow"}) {
    const auto columns = a.dataset(name).shape.size() > 1 ? size_t(a.dataset(name).shape[1]) : 1;
    std::vector<double> x(columns), y(columns), z(columns);
    a.read_rows(name, 40, 1, x.data());
    b.read_rows(name, 20, 1, y.data());
    b.read_rows(name, 0, 1, z.data());
    for (size_t k = 0; k < columns; ++k) {
      off = std::max(off, std::fabs(x[k] - y[k]));
      moved = std::max(moved, std::fabs(x[k] - z[k]));
    }
  }
  EXPECT_LE(off, 1e-13);  // roundings of 20 m; measured 4e-15
  EXPECT_GT(moved, 1);
  // Its pictures need the other run no more: where it begins is its own first record.
  fs::remove_all(folder / "half");
  EXPECT_EQ(scene::moved_in(folder / "rest").mechanisms.size(), 1u);
}

TEST(StartFrom, AMissingRunRecordOrStateIsRefusedWithItsPlace) {
  TemporaryFolder folder;
  run_into(arm(folder, "a", bent, 1), folder / "first");
  const auto refusal = [&](const std::string& initial, const std::string& more = "") {
    return refusal_of([&] { (void)scene::assemble(arm(folder, "b", initial, 1, more)); });
  };
  EXPECT_TRUE(says(refusal("from = \"nowhere\""), "has no run.h5"));
  EXPECT_TRUE(says(refusal("from = \"nowhere\""), "b.toml:8:"));
  EXPECT_TRUE(says(refusal("from = \"first\"\nat = 0.07"), "no record at 0.07 s, the nearest one"));
  EXPECT_TRUE(says(refusal("at = 0.05"), "given without from"));
  EXPECT_TRUE(says(refusal("from = \"first\"\njoints.elbow.position = 1"),
                   "given besides from, which states the whole start"));
  auto s = arm(folder, "c", "from = \"first\"", 1);
  s.urdf_text = two_arms_urdf();
  EXPECT_TRUE(says(refusal_of([&] { (void)scene::assemble(s); }), "ja, ja, jb, jb are missing"));
}

}  // namespace porthos::test::extension_test
