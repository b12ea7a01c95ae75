#include "scene/run/whole_report.h"

#include <gtest/gtest.h>

#include "scene/read/scene.h"
#include "scene/session/report_reader.h"
#include "tests/run/scenes.h"

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

/// The notes of a run of phases that begin at 0 s, 1 s, ...
std::vector<std::string> notes_of(const std::vector<RunReport>& phases) {
  WholeReport whole{Scene{}};
  for (size_t k = 0; k < phases.size(); ++k) whole.add(phases[k], double(k));
  whole.finish();
  return whole.report().notes;
}
RunReport noting(std::initializer_list<std::string> notes) {
  RunReport phase;
  phase.notes = notes;
  return phase;
}
using Notes = std::vector<std::string>;

TEST(WholeReport, NotesOfOneKindAreMergedOverThePhases) {
  EXPECT_EQ(notes_of({noting({"'a1' up to 1.5e-3 N"}), noting({"'a1' up to 2 N"}),
                      noting({"'a1' up to 2 N"})}),
            (Notes{"from 0 s: 'a1' up to 1.5e-3 N (with other numbers from 1 s, 2 s)"}));
  EXPECT_EQ(notes_of({noting({"up to 1 N"}), noting({"up to 1 N"})}),
            (Notes{"from 0 s: up to 1 N"}))
      << "control: the same numbers";
  EXPECT_EQ(notes_of({noting({"'a1' up to 1 N"}), noting({"'a2' up to 1 N"})}),
            (Notes{"from 0 s: 'a1' up to 1 N", "from 1 s: 'a2' up to 1 N"}))
      << "control: names are not numbers";
  const auto often = notes_of({noting({"x 1"}), noting({"x 2"}), noting({"x 3"}), noting({"x 4"}),
                               noting({"x 5"}), noting({"y"})});
  EXPECT_EQ(often, (Notes{"from 0 s: x 1 (with other numbers from 1 s, 2 s, ...)", "from 5 s: y"}));
}

/// A phase in which one controller has delivered `most`, and `left` of it at the end [J].
RunReport delivering(double most, double left, double exchanged) {
  RunReport phase;
  phase.energy.scale_J = phase.turned_over_J = exchanged;
  phase.delivered = {{"wheel", most}};
  phase.ports = {{"wheel", left}};
  note_delivered(phase);
  return phase;
}

TEST(WholeReport, EnergyDeliveredByControllersIsToldOfTheWhole) {
  const Notes known = {
      "net energy delivered by controllers: 'wheel' up to 3 J: not passive unless "
      "stored at the start"};
  EXPECT_EQ(notes_of({delivering(2, 1, 100), delivering(2, 2, 100)}), known)
      << "1 J of the first phase and up to 2 J more";
  EXPECT_EQ(notes_of({noting({known[0]})}), (Notes{"from 0 s: " + known[0]}))
      << "control: the words alone are any note";
  EXPECT_EQ(notes_of({delivering(3, -5, 100), delivering(2, 2, 100)}), known) << "the most so far";
  EXPECT_EQ(notes_of({delivering(0, -3, 100), delivering(2, 2, 100)}), Notes{})
      << "control: it gives back what it took";
}

TEST(WholeReport, EnergyDeliveredIsNotedFromAMillionthOfTheEnergyExchangedOn) {
  EXPECT_EQ(delivering(1e-10, 0, 145).notes, Notes{});
  EXPECT_EQ(delivering(1.4e-4, 0, 145).notes, Notes{});
  EXPECT_EQ(delivering(1.5e-4, 0, 145).notes.size(), 1u) << "control";
  EXPECT_EQ(delivering(1e-4, 0, 1).notes.size(), 1u);
  EXPECT_EQ(notes_of({delivering(1e-4, 0, 1), delivering(0, 0, 145)}), Notes{})
      << "of the whole run, not of the phase";
}

/// A phase of so many steps, in so many of which Newton's method has factorised a matrix.
RunReport solving(std::int64_t steps, std::int64_t factorisations) {
  RunReport phase;
  phase.cost = {.steps = steps, .factorisations = factorisations};
  note_newton(phase, "Newton, dense");
  return phase;
}

TEST(WholeReport, NewtonsMethodIsNotedWhereItsCostMatters) {
  EXPECT_EQ(solving(1000, 100).notes, Notes{});
  EXPECT_EQ(solving(1000, 101).notes.size(), 1u) << "control";
  EXPECT_EQ(notes_of({solving(200, 200), solving(29800, 0)}), Notes{})
      << "the start of a phase alone";
  EXPECT_EQ(notes_of({solving(200, 0), solving(29800, 5000), solving(1000, 500)}),
            (Notes{"from 1 s: fixed-point iteration did not suffice for all equations: Newton, "
                   "dense"}));
  RunReport ended = solving(29800, 0);
  ended.outcome = integrators::Outcome::not_converged;
  EXPECT_EQ(notes_of({solving(200, 200), ended}).size(), 1u) << "where the run ended early";
}

/// What notes and words are made from is in the file; one without it is read as well.
TEST(WholeReport, WhatIsKnownBesideTheWordsIsReadBack) {
  const test::TemporaryFolder folder;
  auto c = test::pendulum(folder);
  c.scene.duration = 0.1;
  RunReport r = run(c.scene, c.assembly, test::into(folder / "out"));
  r.notes = {"a note"};
  r.delivered = {{"wheel", 3}};
  note_delivered(r);
  r.energy.growth_exponent = NAN;
  r.energy.unknown = GrowthUnknown::scatter;
  r.energy.kinks = true;
  const auto back = [&](const std::string& without) {
    auto text = summary_json(c.scene, c.assembly, r, r.final_state);
    for (size_t at; !without.empty() && (at = text.find(without)) != text.npos;)
      text.replace(at, without.size(), "\"other\"");
    test::write_bytes(folder / "out" / "summary.json", text);
    return read_report(folder / "out", r.final_state);
  };
  const RunReport same = back("");
  EXPECT_EQ(same.energy.unknown, GrowthUnknown::scatter);
  EXPECT_TRUE(same.energy.kinks);
  EXPECT_EQ(same.delivered_note, 1);
  EXPECT_EQ(same.newton_note, -1);
  EXPECT_EQ(back("\"growth_unknown\"").energy.unknown, GrowthUnknown::no);
  EXPECT_FALSE(back("\"kinks\"").energy.kinks);
  EXPECT_EQ(back("\"delivered_note\"").delivered_note, -1);
}

}  // namespace
}  // namespace porthos::scene::whole_report_test
