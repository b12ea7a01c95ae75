#pragma once
#include "report/detail/series.h"
#include "scene/read/scene.h"

/// The parts of a page that come from files of their own.
namespace porthos::report {

/// What a run states about the credibility factors of a simulation, named after NASA-STD-7009A
/// (2016), section 4.4. Nothing is graded: a reviewer assigns levels.
/// @param summary  summary.json;  comparison  compare.json of the same scene or null;  scene may be
///   null
/// @return array of {factor, stands: "stated" | "partly" | "not stated", text}
Json credibility(const Json& summary, const Json& comparison, const scene::Scene* scene);

/// The cases of a finished ensemble for the page: of every input, error, output and event its
/// histogram over all cases, those that passed and the others apart; and the numbers of some cases,
/// among them the first that did not pass and the worst.
/// {"count", "columns": [{"name", "group", "unit", "log", "low", "high", "passed", "others", "v"}],
/// "shown", "verdicts", "status"}; v: of the cases in "shown"; low, high: of log10 where "log".
/// @throws InvalidArgument for a file that is not as an ensemble writes it
Json ensemble_data(const std::filesystem::path& h5);

/// The page's data of a folder with an ensemble; what cannot be read is named under "missing".
Json ensemble_page(const std::filesystem::path& folder);
bool holds_ensemble(const std::filesystem::path& folder);

/// The page's data of a folder that porthos identify wrote; what cannot be read is named under
/// "missing".
Json identification_page(const std::filesystem::path& folder);
bool holds_identification(const std::filesystem::path& folder);

}  // namespace porthos::report
