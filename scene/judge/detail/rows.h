#pragma once
#include "scene/judge/detail/trajectory.h"
#include "scene/run/run_report.h"

namespace porthos::scene {

/// Fills the growth of the energy's error and the notes on the rows. Where a few rows are missing,
/// a line through the gap stands for them; of the pieces beside a hole of more than 10 the longest
/// counts, if it is a third of the time. Rows at unequal intervals do not tell how the error grows.
/// @param errors of the energy, by row [J]
void tell_of_rows(RunReport& r, const Rows& rows, const Numbers& errors);

/// Notes the row whose energy alone is far off, as of a spike, where the energy fails its limit.
/// @param errors of the energy, by row [J]
void note_one_row(RunReport& r, const Rows& rows, const Numbers& errors);

/// Notes how the error of a momentum that fails grows, in the words of the energy's. Not where rows
/// are at unequal intervals.
/// @param errors of the momentum of that check, by row [N s | N m s]
void tell_of_momentum(RunReport& r, const Rows& rows, const std::string& check,
                      const Numbers& errors);

/// Positions must move as their rates say: otherwise energies are those of another motion, as with
/// times in milliseconds or rates along other axes. The worst coordinate counts, relative to its
/// way; five times the error of the rule that adds the rates up is no disagreement. Where this is
/// most of the way, or rates change from row to row by more than their size, the rows are too few
/// to tell. A leap between two rows fails too. Fewer than four rows judge nothing, fewer than ten
/// little.
void check_rates(RunReport& r, const RatesAgreement& rates, const Rows& rows);

/// Notes what disagrees; where nothing explains a failure, the usual causes. Where a question about
/// the unit of time is open and no coordinate could be checked, the rates are undecided.
/// @param explained  a note has asked about units or columns: none asks about the unit of time
void note_rates(RunReport& r, const RatesAgreement& rates, const Rows& rows, bool explained);

}  // namespace porthos::scene
