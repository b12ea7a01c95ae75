#pragma once
#include <filesystem>
#include <nlohmann/json.hpp>

namespace porthos::report {

using Json = nlohmann::ordered_json;

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

}  // namespace porthos::report
